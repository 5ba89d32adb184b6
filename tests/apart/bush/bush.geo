// A hollow shaft in a bush, right half, triangles; the arcs of contact are meshed apart and do not match.
// gmsh -2 bush.geo -setnumber h 0.4 -o bush.msh      h: edge on the bush's arc of contact; on the shaft's 1.37 h
Geometry.AutoCoherence = 0;
DefineConstant[ h = {0.4, Name "Size"}, radius = {9.9}, inner = {10}, outer = {14}, hole = {4} ];
c = radius - inner;   // height of the shaft's centre: it sits on the bush's lowest point
// bush: centre (0, 0)
Point(1) = {0, 0, 0};
Point(2) = {0, -inner, 0, h};    Point(3) = {inner, 0, 0, h};      Point(4) = {0, inner, 0, 4*h};
Point(5) = {0, -outer, 0, 3*h};  Point(6) = {outer, 0, 0, 3*h};    Point(7) = {0, outer, 0, 4*h};
Circle(1) = {2, 1, 3};  Circle(2) = {3, 1, 4};  Line(3) = {4, 7};
Circle(4) = {7, 1, 6};  Circle(5) = {6, 1, 5};  Line(6) = {5, 2};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};  Plane Surface(1) = {1};
Transfinite Curve {1} = Round(Pi/2*inner/h)+1;
// shaft: centre (0, c)
Point(11) = {0, c, 0};
Point(12) = {0, c-radius, 0, 1.37*h};  Point(13) = {radius, c, 0, 1.37*h};  Point(14) = {0, c+radius, 0, 4*h};
Point(15) = {0, c-hole, 0, 2.5*h};     Point(16) = {hole, c, 0, 2.5*h};     Point(17) = {0, c+hole, 0, 3*h};
Circle(11) = {12, 11, 13};  Circle(12) = {13, 11, 14};  Line(13) = {14, 17};
Circle(14) = {17, 11, 16};  Circle(15) = {16, 11, 15};  Line(16) = {15, 12};
Curve Loop(2) = {11, 12, 13, 14, 15, 16};  Plane Surface(2) = {2};
Transfinite Curve {11} = Round(Pi/2*radius/(1.37*h))+1;
Physical Surface("bush", 1) = {1};
Physical Surface("shaft", 2) = {2};
Physical Curve("bush_inside", 11) = {1};
Physical Curve("bush_outside", 12) = {4, 5};
Physical Curve("bush_sym", 13) = {3, 6};
Physical Curve("shaft_outside", 14) = {11, 12};
Physical Curve("shaft_core", 15) = {14, 15};
Physical Curve("shaft_sym", 16) = {13, 16};
