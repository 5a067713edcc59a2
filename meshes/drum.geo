// Circular drum: an unstructured core inside concentric rings of split quadrilaterals.
// gmsh -2 drum.geo -setnumber radius 2.5e-6 -setnumber size 0.5e-6
DefineConstant[
  radius    = {1,    Name "Parameters/radius"},
  size      = {0.35, Name "Parameters/size"},      // edge length of the core's cells
  core      = {1,    Name "Parameters/core"},      // radius of the core / radius of the drum
  rings     = {0,    Name "Parameters/rings"},     // rings of equal width between core and edge
  sectors   = {16,   Name "Parameters/sectors"},   // cells around a whole ring (a multiple of 4)
  quadrants = {4,    Name "Parameters/quadrants"}  // 4: all of it; 1: the quarter x > 0, y > 0
];
step = 0;
If (rings == 0)
  core = 1;
Else
  step = (1 - core) / rings;
EndIf
last = quadrants == 4 ? 3 : quadrants;   // number of the last radius, the first being +x

Point(1) = {0, 0, 0, size};
For ring In {0 : rings}
  r = radius * (core + step * ring);
  For spoke In {0 : last}
    Point(10 * ring + spoke + 2) = {r * Cos(spoke * Pi / 2), r * Sin(spoke * Pi / 2), 0, size};
  EndFor
  For quadrant In {0 : quadrants - 1}
    Circle(10 * ring + quadrant + 1) = {10 * ring + quadrant + 2, 1, 10 * ring + (quadrant + 1) % 4 + 2};
    If (rings > 0)
      Transfinite Curve {10 * ring + quadrant + 1} = sectors / 4 + 1;
    EndIf
  EndFor
EndFor

on_x() = {};   // curves on the x axis of a quarter
on_y() = {};
If (quadrants == 4)
  Curve Loop(1) = {1, 2, 3, 4};
Else
  Line(5001) = {1, 2};
  Line(5002) = {3, 1};
  Curve Loop(1) = {5001, 1, 5002};
  on_x() += {5001};
  on_y() += {5002};
EndIf
Plane Surface(1) = {1};
film() = {1};
For ring In {1 : rings}
  spokes = 1000 + 10 * ring;
  For spoke In {0 : last}
    Line(spokes + spoke) = {10 * (ring - 1) + spoke + 2, 10 * ring + spoke + 2};
    Transfinite Curve {spokes + spoke} = 2;
  EndFor
  If (quadrants == 1)
    on_x() += {spokes};
    on_y() += {spokes + 1};
  EndIf
  For quadrant In {0 : quadrants - 1}
    sheet = 10 * ring + quadrant + 1;
    Curve Loop(sheet) = {spokes + quadrant, 10 * ring + quadrant + 1,
                         -(spokes + (quadrant + 1) % 4), -(10 * (ring - 1) + quadrant + 1)};
    Plane Surface(sheet) = {sheet};
    Transfinite Surface {sheet} Alternate;
    film() += {sheet};
  EndFor
EndFor

Physical Surface("film") = {film()};
edge() = {};
For quadrant In {0 : quadrants - 1}
  edge() += {10 * rings + quadrant + 1};
EndFor
Physical Curve("edge") = {edge()};
If (quadrants == 1)
  Physical Curve("y=0") = {on_x()};
  Physical Curve("x=0") = {on_y()};
EndIf
