// Dome: a cap of a sphere over a circle; a surface in space, for plate.model = "shell".
DefineConstant[
  radius = {1, Name "Parameters/radius"} // of the circle that it stands on
  height = {0.2, Name "Parameters/height"} // less than radius: no more than a hemisphere
  size = {0.4, Name "Parameters/size"} // of the triangles
];
sphere = (radius^2 + height^2) / (2 * height);
Mesh.MeshSizeExtendFromBoundary = 1;
Point(1) = {0, 0, height - sphere, size}; // centre of the sphere
Point(2) = {0, 0, 0, size}; // centre of the circle
Point(3) = {0, 0, height, size}; // top
For i In {0:3}
  Point(4 + i) = {radius * Cos(i * Pi / 2), radius * Sin(i * Pi / 2), 0, size};
EndFor
For i In {0:3}
  Circle(1 + i) = {4 + i, 2, 4 + (i + 1) % 4};
  Circle(5 + i) = {3, 1, 4 + i};
EndFor
For i In {0:3}
  Curve Loop(1 + i) = {5 + i, 1 + i, -(5 + (i + 1) % 4)};
  Surface(1 + i) = {1 + i} In Sphere{1};
EndFor
Physical Curve("edge") = {1:4};
Physical Surface("film") = {1:4};
