// Rectangular membrane or plate, centred at the origin: n_x by n_y split quadrilaterals.
// gmsh -2 rectangle.geo -setnumber length 100e-6 -setnumber width 50e-6
DefineConstant[
  length = {1, Name "Parameters/length"},   // along x
  width  = {1, Name "Parameters/width"},    // along y
  n_x    = {4, Name "Parameters/n_x"},      // cells along x
  n_y    = {4, Name "Parameters/n_y"},      // cells along y
  half_x = {0, Name "Parameters/half_x"},   // 1: only x > 0
  half_y = {0, Name "Parameters/half_y"}    // 1: only y > 0
];
x0 = half_x ? 0 : -length / 2;
y0 = half_y ? 0 : -width / 2;

Point(1) = {x0, y0, 0};
Point(2) = {length / 2, y0, 0};
Point(3) = {length / 2, width / 2, 0};
Point(4) = {x0, width / 2, 0};
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
Physical Curve("right") = {2};
Physical Curve("top") = {3};
If (half_x)
  Physical Curve("x=0") = {4};
Else
  Physical Curve("left") = {4};
EndIf
If (half_y)
  Physical Curve("y=0") = {1};
Else
  Physical Curve("bottom") = {1};
EndIf
