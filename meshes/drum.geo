// Circular drum: a fan of triangles around the centre inside concentric rings of triangles.
// gmsh -2 drum.geo -setnumber radius 2.5e-6 -setnumber rings 4
DefineConstant[
  radius    = {1, Name "Parameters/radius"},
  rings     = {3, Name "Parameters/rings"},       // circles, the edge included, equally spaced
  growth    = {2, Name "Parameters/growth"},      // cells that each ring has more per quadrant
  sectors   = {64, Name "Parameters/sectors"},    // at most so many cells around a whole ring
  quadrants = {4, Name "Parameters/quadrants"}    // 4: all of it; 1: the quarter x > 0, y > 0
];
Mesh.Algorithm = 3;                               // no vertices but those on the circles
last = quadrants == 4 ? 3 : quadrants;            // number of the last radius, the first being +x

film() = {};
edge() = {};
on_x() = {};   // curves on the x axis of a quarter
on_y() = {};
Point(1) = {0, 0, 0, 10 * radius};
For ring In {1 : rings}
  r = radius * ring / rings;
  For spoke In {0 : last}
    Point(10 * ring + spoke) = {r * Cos(spoke * Pi / 2), r * Sin(spoke * Pi / 2), 0, 10 * radius};
  EndFor
  cells = ring * growth;
  If (cells > sectors / 4)
    cells = sectors / 4;
  EndIf
  For quadrant In {0 : quadrants - 1}
    arc = 10 * ring + quadrant;
    Circle(arc) = {10 * ring + quadrant, 1, 10 * ring + (quadrant + 1) % 4};
    Transfinite Curve {arc} = Ceil(cells) + 1;
    If (ring == rings)
      edge() += {arc};
    EndIf
  EndFor
  spokes = 10 * (rings + ring + 1);
  For spoke In {0 : last}
    inner = ring == 1 ? 1 : 10 * (ring - 1) + spoke;
    Line(spokes + spoke) = {inner, 10 * ring + spoke};
    Transfinite Curve {spokes + spoke} = 2;
  EndFor
  If (quadrants == 1)
    on_x() += {spokes};
    on_y() += {spokes + 1};
  EndIf
  For quadrant In {0 : quadrants - 1}
    sheet = 10 * ring + quadrant;
    If (ring == 1)
      Curve Loop(sheet) = {spokes + quadrant, sheet, -(spokes + (quadrant + 1) % 4)};
    Else
      Curve Loop(sheet) = {spokes + quadrant, sheet,
                           -(spokes + (quadrant + 1) % 4), -(sheet - 10)};
    EndIf
    Plane Surface(sheet) = {sheet};
    film() += {sheet};
  EndFor
EndFor

Physical Surface("film") = {film()};
Physical Curve("edge") = {edge()};
If (quadrants == 1)
  Physical Curve("y=0") = {on_x()};
  Physical Curve("x=0") = {on_y()};
EndIf
