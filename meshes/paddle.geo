// Cantilever along x with a wider tip: held at "clamp", everything else is "free".
// gmsh -2 paddle.geo -setnumber length 30e-6 -setnumber width 4e-6 -setnumber tip_length 10e-6
DefineConstant[
  length     = {1,    Name "Parameters/length"},      // of the cantilever before its tip
  width      = {0.2,  Name "Parameters/width"},
  tip_length = {0.3,  Name "Parameters/tip_length"},
  tip_width  = {0.6,  Name "Parameters/tip_width"},
  fillet     = {0.05, Name "Parameters/fillet"},      // radius where the tip begins
  size       = {0.1,  Name "Parameters/size"}         // edge length of the cells
];
half = width / 2;
wide = tip_width / 2;
Point(1) = {0, -half, 0, size};
Point(2) = {length - fillet, -half, 0, size};
Point(3) = {length - fillet, -half - fillet, 0, size};   // centre of the fillet
Point(4) = {length, -half - fillet, 0, size};
Point(5) = {length, -wide, 0, size};
Point(6) = {length + tip_length, -wide, 0, size};
Point(7) = {length + tip_length, wide, 0, size};
Point(8) = {length, wide, 0, size};
Point(9) = {length, half + fillet, 0, size};
Point(10) = {length - fillet, half + fillet, 0, size};   // centre of the fillet
Point(11) = {length - fillet, half, 0, size};
Point(12) = {0, half, 0, size};
Line(1) = {1, 2};
Circle(2) = {2, 3, 4};
Line(3) = {4, 5};
Line(4) = {5, 6};
Line(5) = {6, 7};
Line(6) = {7, 8};
Line(7) = {8, 9};
Circle(8) = {9, 10, 11};
Line(9) = {11, 12};
Line(10) = {12, 1};
Curve Loop(1) = {1 : 10};
Plane Surface(1) = {1};

Physical Surface("film") = {1};
Physical Curve("clamp") = {10};
Physical Curve("free") = {1 : 9};
