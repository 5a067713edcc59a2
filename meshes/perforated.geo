// Drum with a square lattice of round holes: its boundaries are "edge" and "holes".
// gmsh -2 perforated.geo -setnumber radius 50e-6 -setnumber pitch 20e-6 -setnumber hole 4e-6
DefineConstant[
  radius = {1,    Name "Parameters/radius"},
  pitch  = {0.5,  Name "Parameters/pitch"},    // of the lattice, a hole at its centre
  hole   = {0.1,  Name "Parameters/hole"},     // radius of the holes
  margin = {0.15, Name "Parameters/margin"},   // least distance from a hole to the edge
  size   = {0.2,  Name "Parameters/size"}      // edge length of the cells
];

Point(1) = {0, 0, 0, size};
For quadrant In {0 : 3}
  Point(quadrant + 2) = {radius * Cos(quadrant * Pi / 2), radius * Sin(quadrant * Pi / 2), 0, size};
EndFor
For quadrant In {0 : 3}
  Circle(quadrant + 1) = {quadrant + 2, 1, (quadrant + 1) % 4 + 2};
EndFor
Curve Loop(1) = {1, 2, 3, 4};

loops() = {1};
rims() = {};
n = Floor(radius / pitch);
first = 10;
fine = size < hole ? size : hole;
For i In {-n : n}
  For j In {-n : n}
    If (Sqrt(i * i + j * j) * pitch + hole + margin <= radius)
      Point(first) = {i * pitch, j * pitch, 0, fine};
      For quadrant In {0 : 3}
        Point(first + quadrant + 1) = {i * pitch + hole * Cos(quadrant * Pi / 2),
                                       j * pitch + hole * Sin(quadrant * Pi / 2), 0, fine};
      EndFor
      For quadrant In {0 : 3}
        Circle(first + quadrant) = {first + quadrant + 1, first, first + (quadrant + 1) % 4 + 1};
      EndFor
      Curve Loop(first) = {first, first + 1, first + 2, first + 3};
      loops() += {first};
      rims() += {first, first + 1, first + 2, first + 3};
      first += 10;
    EndIf
  EndFor
EndFor
Plane Surface(1) = {loops()};

Physical Surface("film") = {1};
Physical Curve("edge") = {1, 2, 3, 4};
Physical Curve("holes") = {rims()};
