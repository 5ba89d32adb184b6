// A hollow shaft in a bush, both about (0, 0), triangles; the arcs of contact are meshed apart and do not match.
// gmsh -2 bush.geo -setnumber h 0.48 -o bush.msh      h: edge on the bush's arc of contact; on the shaft's 1.37 h
Geometry.AutoCoherence = 0;
DefineConstant[ h = {0.45, Name "Size"}, radius = {9.9}, inner = {10}, outer = {14}, hole = {4} ];
Point(1) = {0, 0, 0};
// bush, inside: from 80 degrees on the left of its lowest point to 140 degrees on the right, and round; outside: the lower half, and round
angle[] = {-80, 30, 140, 210};
For i In {0:3}
  a = angle[i]*Pi/180;
  Point(11+i) = {inner*Sin(a), -inner*Cos(a), 0, (i < 3 ? h : 4*h)};
EndFor
Circle(11) = {11, 1, 12};  Circle(12) = {12, 1, 13};  Circle(13) = {13, 1, 14};  Circle(14) = {14, 1, 11};
Transfinite Curve {11, 12} = Round(110*Pi/180*inner/h)+1;
// quarters, from the left by the lowest point: the bush's outside, the shaft's outside, its bore
r[] = {outer, radius, hole};
size[] = {2.5*h, 1.37*h, 2.5*h};
For k In {0:2}
  o = 20 + 10*k;
  Point(o+1) = {-r[k], 0, 0, size[k]};  Point(o+2) = {0, -r[k], 0, size[k]};
  Point(o+3) = {r[k], 0, 0, size[k]};   Point(o+4) = {0, r[k], 0, size[k]};
  Circle(o+1) = {o+1, 1, o+2};  Circle(o+2) = {o+2, 1, o+3};  Circle(o+3) = {o+3, 1, o+4};  Circle(o+4) = {o+4, 1, o+1};
EndFor
Transfinite Curve {31:34} = Round(Pi/2*radius/(1.37*h))+1;
Curve Loop(1) = {11:14};  Curve Loop(2) = {21:24};  Plane Surface(1) = {2, 1};
Curve Loop(3) = {31:34};  Curve Loop(4) = {41:44};  Plane Surface(2) = {3, 4};
Physical Surface("bush", 1) = {1};
Physical Surface("shaft", 2) = {2};
Physical Curve("bush_inside", 11) = {11, 12};
Physical Curve("bush_foot", 12) = {21, 22};
Physical Curve("shaft_outside", 13) = {31:34};
Physical Curve("shaft_bore", 14) = {41:44};
