// Doubly clamped string along x: its short ends are "left" and "right".
// gmsh -2 string.geo -setnumber length 300e-6 -setnumber width 3e-6
DefineConstant[
  length = {1,    Name "Parameters/length"},
  width  = {0.02, Name "Parameters/width"},
  n_x    = {16,   Name "Parameters/n_x"},     // cells along x
  n_y    = {1,    Name "Parameters/n_y"}      // cells along y
];
Include "rectangle.geo";
