// Trampoline: a square pad held by four tethers along the axes; with pad = width it is a cross.
// The tethers end in "ends", everything else is "free"; fillets round the corners at the pad.
// gmsh -2 trampoline.geo -setnumber length 100e-6 -setnumber pad 30e-6 -setnumber width 5e-6
DefineConstant[
  length = {1,    Name "Parameters/length"},   // from end to end
  pad    = {0.3,  Name "Parameters/pad"},      // side of the pad
  width  = {0.08, Name "Parameters/width"},    // of the tethers
  fillet = {0.04, Name "Parameters/fillet"},   // radius where a tether meets the pad
  size   = {0.06, Name "Parameters/size"}      // edge length of the cells
];
half = width / 2;
reach = pad / 2;
If (reach - half < fillet)                     // no room on the pad's side: a cross
  reach = half;
EndIf
cross = reach == half;

free() = {};
ends() = {};
around() = {};
For arm In {0 : 3}
  c = Cos(arm * Pi / 2);
  s = Sin(arm * Pi / 2);
  p = 100 * arm;
  // along the arm (x, y) -> (c x - s y, s x + c y), from its right-hand side around its end
  x(0) = reach + fillet;  y(0) = -half;
  x(1) = length / 2;      y(1) = -half;
  x(2) = length / 2;      y(2) = half;
  x(3) = reach + fillet;  y(3) = half;
  x(4) = reach + fillet;  y(4) = half + fillet;    // centre of the fillet
  x(5) = reach;           y(5) = half + fillet;    // end of the fillet on the pad's side
  x(6) = reach;           y(6) = reach;            // corner of the pad
  x(7) = half + fillet;   y(7) = reach;            // start of the next fillet
  x(8) = half + fillet;   y(8) = reach + fillet;   // its centre
  For i In {0 : 8}
    Point(p + i + 1) = {c * x(i) - s * y(i), s * x(i) + c * y(i), 0, size};
  EndFor
EndFor
For arm In {0 : 3}
  p = 100 * arm;
  q = 100 * ((arm + 1) % 4);                       // the next arm
  Line(p + 1) = {p + 1, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p + 4};
  free() += {p + 1, p + 3};
  ends() += {p + 2};
  around() += {p + 1, p + 2, p + 3};
  If (cross)                                       // one fillet from arm to arm
    Circle(p + 4) = {p + 4, p + 5, q + 1};
    free() += {p + 4};
    around() += {p + 4};
  Else
    Circle(p + 4) = {p + 4, p + 5, p + 6};
    Line(p + 5) = {p + 6, p + 7};
    Line(p + 6) = {p + 7, p + 8};
    Circle(p + 7) = {p + 8, p + 9, q + 1};
    free() += {p + 4, p + 5, p + 6, p + 7};
    around() += {p + 4, p + 5, p + 6, p + 7};
  EndIf
EndFor
Curve Loop(1) = {around()};
Plane Surface(1) = {1};

Physical Surface("film") = {1};
Physical Curve("ends") = {ends()};
Physical Curve("free") = {free()};
