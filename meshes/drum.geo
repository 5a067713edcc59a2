// Circular drum: an unstructured core inside concentric rings of split quadrilaterals.
// gmsh -2 drum.geo -setnumber radius 2.5e-6 -setnumber size 0.5e-6
DefineConstant[
  radius  = {1,    Name "Parameters/radius"},
  size    = {0.35, Name "Parameters/size"},      // edge length of the core's cells
  core    = {1,    Name "Parameters/core"},      // radius of the core / radius of the drum
  rings   = {0,    Name "Parameters/rings"},     // rings of equal width between core and edge
  sectors = {16,   Name "Parameters/sectors"}    // cells around a ring (a multiple of 4)
];
step = 0;
If (rings == 0)
  core = 1;
Else
  step = (1 - core) / rings;
EndIf

Point(1) = {0, 0, 0, size};
For ring In {0 : rings}
  r = radius * (core + step * ring);
  For quadrant In {0 : 3}
    Point(10 * ring + quadrant + 2) = {r * Cos(quadrant * Pi / 2), r * Sin(quadrant * Pi / 2), 0, size};
  EndFor
  For quadrant In {0 : 3}
    Circle(10 * ring + quadrant + 1) = {10 * ring + quadrant + 2, 1, 10 * ring + (quadrant + 1) % 4 + 2};
    If (rings > 0)
      Transfinite Curve {10 * ring + quadrant + 1} = sectors / 4 + 1;
    EndIf
  EndFor
EndFor

Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
film() = {1};
For ring In {1 : rings}
  spokes = 1000 + 10 * ring;
  For quadrant In {0 : 3}
    Line(spokes + quadrant) = {10 * (ring - 1) + quadrant + 2, 10 * ring + quadrant + 2};
    Transfinite Curve {spokes + quadrant} = 2;
  EndFor
  For quadrant In {0 : 3}
    sheet = 10 * ring + quadrant + 1;
    Curve Loop(sheet) = {spokes + quadrant, 10 * ring + quadrant + 1,
                         -(spokes + (quadrant + 1) % 4), -(10 * (ring - 1) + quadrant + 1)};
    Plane Surface(sheet) = {sheet};
    Transfinite Surface {sheet} Alternate;
    film() += {sheet};
  EndFor
EndFor

Physical Surface("film") = {film()};
outer = 10 * rings;
Physical Curve("edge") = {outer + 1, outer + 2, outer + 3, outer + 4};
