// Annular film: its boundaries are "outer" and "inner".
// gmsh -2 annulus.geo -setnumber outer 2.5e-6 -setnumber inner 1e-6 -setnumber size 0.5e-6
DefineConstant[
  outer = {1,   Name "Parameters/outer"},   // radii
  inner = {0.4, Name "Parameters/inner"},
  size  = {0.3, Name "Parameters/size"}     // edge length of the cells
];

Point(1) = {0, 0, 0, size};
For circle In {0 : 1}
  r = circle == 0 ? outer : inner;
  For quadrant In {0 : 3}
    Point(10 * circle + quadrant + 2) = {r * Cos(quadrant * Pi / 2), r * Sin(quadrant * Pi / 2), 0, size};
  EndFor
  For quadrant In {0 : 3}
    Circle(10 * circle + quadrant + 1) = {10 * circle + quadrant + 2, 1, 10 * circle + (quadrant + 1) % 4 + 2};
  EndFor
  Curve Loop(circle + 1) = {10 * circle + 1, 10 * circle + 2, 10 * circle + 3, 10 * circle + 4};
EndFor
Plane Surface(1) = {1, 2};

Physical Surface("film") = {1};
Physical Curve("outer") = {1, 2, 3, 4};
Physical Curve("inner") = {11, 12, 13, 14};
