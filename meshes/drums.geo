// Drums in a row along x, joined by channels: all of the boundary is "edge"; two are a dumbbell.
// gmsh -2 drums.geo -setnumber count 3 -setnumber radius 2e-6 -setnumber pitch 5e-6
DefineConstant[
  count   = {2,   Name "Parameters/count"},     // of drums, from 2
  radius  = {1,   Name "Parameters/radius"},
  pitch   = {2.3, Name "Parameters/pitch"},     // from centre to centre, more than two radii
  channel = {0.6, Name "Parameters/channel"},   // its width
  size    = {0.5, Name "Parameters/size"}       // edge length of the cells
];
half = channel / 2;
reach = Sqrt(radius * radius - half * half);     // from a centre to where a channel begins
around() = {};
For i In {0 : count - 1}
  p = 10 * i + 1;
  c = (i - (count - 1) / 2) * pitch;
  Point(p) = {c, 0, 0, size};
  Point(p + 1) = {c, -radius, 0, size};
  Point(p + 2) = {c, radius, 0, size};
  If (i == 0)
    Point(p + 3) = {c - radius, 0, 0, size};
  Else
    Point(p + 3) = {c - reach, -half, 0, size};
    Point(p + 4) = {c - reach, half, 0, size};
  EndIf
  If (i == count - 1)
    Point(p + 5) = {c + radius, 0, 0, size};
  Else
    Point(p + 5) = {c + reach, -half, 0, size};
    Point(p + 6) = {c + reach, half, 0, size};
  EndIf
EndFor
For i In {0 : count - 1}                          // below, from left to right
  p = 10 * i + 1;
  Circle(p) = {p + 3, p, p + 1};
  Circle(p + 1) = {p + 1, p, p + 5};
  around() += {p, p + 1};
  If (i < count - 1)
    Line(p + 2) = {p + 5, p + 10 + 3};
    around() += {p + 2};
  EndIf
EndFor
For j In {0 : count - 1}                          // above, back
  i = count - 1 - j;
  p = 10 * i + 1;
  right = i == count - 1 ? p + 5 : p + 6;
  left = i == 0 ? p + 3 : p + 4;
  Circle(p + 4) = {right, p, p + 2};
  Circle(p + 5) = {p + 2, p, left};
  around() += {p + 4, p + 5};
  If (i > 0)
    Line(p + 6) = {p + 4, p - 10 + 6};
    around() += {p + 6};
  EndIf
EndFor
Curve Loop(1) = {around()};
Plane Surface(1) = {1};

Physical Surface("film") = {1};
Physical Curve("edge") = {around()};
