// Elliptic drum, centred at the origin, its axes along x and y.
// gmsh -2 ellipse.geo -setnumber a 3e-6 -setnumber b 2e-6 -setnumber size 0.5e-6
DefineConstant[
  a    = {1,   Name "Parameters/a"},       // half axis along x
  b    = {0.6, Name "Parameters/b"},       // half axis along y
  size = {0.3, Name "Parameters/size"}     // edge length of the cells
];

Point(1) = {0, 0, 0, size};
Point(2) = { a, 0, 0, size};
Point(3) = {0,  b, 0, size};
Point(4) = {-a, 0, 0, size};
Point(5) = {0, -b, 0, size};
long = a > b ? 2 : 3;                      // a point on the major axis
Ellipse(1) = {2, 1, long, 3};
Ellipse(2) = {3, 1, long, 4};
Ellipse(3) = {4, 1, long, 5};
Ellipse(4) = {5, 1, long, 2};

Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

Physical Surface("film") = {1};
Physical Curve("edge") = {1, 2, 3, 4};
