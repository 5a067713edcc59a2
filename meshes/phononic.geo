// Rectangle with a hexagonal lattice of round holes but for a defect in its middle, where a mode
// can hide from the "edge" (Tsaturyan et al. 2017, doi:10.1038/nnano.2017.101); "holes" are free.
// gmsh -2 phononic.geo -setnumber length 1.6e-3 -setnumber width 1.5e-3 -setnumber pitch 160e-6
DefineConstant[
  length = {1,    Name "Parameters/length"},
  width  = {0.9,  Name "Parameters/width"},
  pitch  = {0.2,  Name "Parameters/pitch"},    // from hole to hole, the middle one at the centre
  hole   = {0.05, Name "Parameters/hole"},     // radius of the holes
  defect = {0.1,  Name "Parameters/defect"},   // no hole's centre is nearer to the middle
  margin = {0.05, Name "Parameters/margin"},   // least distance from a hole to the edge
  size   = {0.1,  Name "Parameters/size"}      // edge length of the cells
];
Point(1) = {-length / 2, -width / 2, 0, size};
Point(2) = {length / 2, -width / 2, 0, size};
Point(3) = {length / 2, width / 2, 0, size};
Point(4) = {-length / 2, width / 2, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};

loops() = {1};
rims() = {};
row = pitch * Sqrt(3) / 2;
n = Ceil(length / pitch) + Ceil(width / row);
first = 10;
fine = size < hole ? size : hole;
For j In {-n : n}
  For i In {-n : n}
    x = (i + j / 2) * pitch;
    y = j * row;
    inside = Fabs(x) + hole + margin <= length / 2 && Fabs(y) + hole + margin <= width / 2;
    If (inside && Sqrt(x * x + y * y) > defect)
      Point(first) = {x, y, 0, fine};
      For quadrant In {0 : 3}
        Point(first + quadrant + 1) = {x + hole * Cos(quadrant * Pi / 2),
                                       y + hole * Sin(quadrant * Pi / 2), 0, fine};
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
