// H: two beams along x, held at both "ends", joined by a bridge in their middle; the rest is "free".
// gmsh -2 hbeam.geo -setnumber length 20e-6 -setnumber width 1e-6 -setnumber gap 3e-6
DefineConstant[
  length = {1,    Name "Parameters/length"},
  width  = {0.06, Name "Parameters/width"},    // of each beam
  gap    = {0.2,  Name "Parameters/gap"},      // between them, spanned by the bridge
  bridge = {0.1,  Name "Parameters/bridge"},   // width of the bridge along x
  fillet = {0.03, Name "Parameters/fillet"},   // radius where it meets a beam
  size   = {0.06, Name "Parameters/size"}      // edge length of the cells
];
free() = {};
ends() = {};
around() = {};
For turn In {0 : 1}                             // half a turn takes one half to the other
  s = 1 - 2 * turn;
  p = 100 * turn;
  x(0) = -length / 2;            y(0) = -gap / 2 - width;
  x(1) = length / 2;             y(1) = -gap / 2 - width;
  x(2) = length / 2;             y(2) = -gap / 2;
  x(3) = bridge / 2 + fillet;    y(3) = -gap / 2;
  x(4) = bridge / 2 + fillet;    y(4) = -gap / 2 + fillet;   // centre of the fillet
  x(5) = bridge / 2;             y(5) = -gap / 2 + fillet;
  x(6) = bridge / 2;             y(6) = gap / 2 - fillet;
  x(7) = bridge / 2 + fillet;    y(7) = gap / 2 - fillet;    // centre of the next
  x(8) = bridge / 2 + fillet;    y(8) = gap / 2;
  x(9) = length / 2;             y(9) = gap / 2;
  For i In {0 : 9}
    Point(p + i + 1) = {s * x(i), s * y(i), 0, size};
  EndFor
EndFor
For turn In {0 : 1}
  p = 100 * turn;
  q = 100 - p;                                  // where the other half begins
  Line(p + 1) = {p + 1, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p + 4};
  Circle(p + 4) = {p + 4, p + 5, p + 6};
  Line(p + 5) = {p + 6, p + 7};
  Circle(p + 6) = {p + 7, p + 8, p + 9};
  Line(p + 7) = {p + 9, p + 10};
  Line(p + 8) = {p + 10, q + 1};
  ends() += {p + 2, p + 8};
  free() += {p + 1, p + 3, p + 4, p + 5, p + 6, p + 7};
  around() += {p + 1, p + 2, p + 3, p + 4, p + 5, p + 6, p + 7, p + 8};
EndFor
Curve Loop(1) = {around()};
Plane Surface(1) = {1};

Physical Surface("film") = {1};
Physical Curve("ends") = {ends()};
Physical Curve("free") = {free()};
