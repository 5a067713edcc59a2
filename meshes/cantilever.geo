// Cantilever along x: held at "clamp", its other sides are "tip" and "sides".
// gmsh -2 cantilever.geo -setnumber length 50e-6 -setnumber width 10e-6
DefineConstant[
  length = {1,   Name "Parameters/length"},
  width  = {0.2, Name "Parameters/width"},
  n_x    = {6,   Name "Parameters/n_x"},    // cells along x
  n_y    = {1,   Name "Parameters/n_y"}     // cells along y
];

Point(1) = {0, -width / 2, 0};
Point(2) = {length, -width / 2, 0};
Point(3) = {length,  width / 2, 0};
Point(4) = {0,  width / 2, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Transfinite Curve {1, 3} = n_x + 1;
Transfinite Curve {2, 4} = n_y + 1;
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Surface {1} Alternate;

Physical Surface("film") = {1};
Physical Curve("clamp") = {4};
Physical Curve("tip") = {2};
Physical Curve("sides") = {1, 3};
