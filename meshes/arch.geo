// Arch: a beam bent to an arc of a circle over the x axis, a solid held at both "ends".
// gmsh -3 arch.geo -setnumber length 500e-6 -setnumber rise 10e-6
DefineConstant[
  length    = {1,    Name "Parameters/length"},     // span between the ends
  rise      = {0.05, Name "Parameters/rise"},       // of the middle line over the ends
  thickness = {0.02, Name "Parameters/thickness"},  // along the radius
  width     = {0.04, Name "Parameters/width"},      // along y
  size      = {0.05, Name "Parameters/size"}        // edge length of the cells
];
radius = (length^2 / 4 + rise^2) / (2 * rise);      // of the middle line
low = rise - radius;                                // height of the centre
half = Asin(length / (2 * radius));                 // angle of an end from the top
Point(1) = {0, -width / 2, low, size};
For i In {0 : 2}                                    // from the left end to the right one
  angle = (i - 1) * half;
  Point(10 + i) = {(radius - thickness / 2) * Sin(angle), -width / 2, low + (radius - thickness / 2) * Cos(angle), size};
  Point(20 + i) = {(radius + thickness / 2) * Sin(angle), -width / 2, low + (radius + thickness / 2) * Cos(angle), size};
EndFor
Circle(1) = {10, 1, 11};
Circle(2) = {11, 1, 12};
Line(3) = {12, 22};
Circle(4) = {22, 1, 21};
Circle(5) = {21, 1, 20};
Line(6) = {20, 10};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};
Plane Surface(1) = {1};
made() = Extrude {0, width, 0} { Surface{1}; };     // the far side, the volume, then one per curve

Physical Volume("solid") = {made(1)};
Physical Surface("ends") = {made(4), made(7)};
Physical Surface("lower") = {made(2), made(3)};
Physical Surface("upper") = {made(5), made(6)};
Physical Surface("sides") = {1, made(0)};
