// A dovetail slide: the rail (a trapezoid, wider above) and the carriage around it, section extruded along z. mm.
// rail
e = 0.001; // so that gmsh does not merge rail and carriage
Point(1) = {-6+e,0,0}; Point(2) = {6-e,0,0}; Point(3) = {10-e,5-e,0}; Point(4) = {-10+e,5-e,0};
For i In {1:3}
  Line(i) = {i,i+1};
EndFor
Line(4) = {4,1};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
// carriage: legs and ceiling
Point(11) = {-17,0,0}; Point(12) = {-6,0,0}; Point(13) = {-10,5,0}; Point(14) = {-17,5,0};
Point(15) = {6,0,0}; Point(16) = {17,0,0}; Point(17) = {17,5,0}; Point(18) = {10,5,0};
Point(21) = {-17,11,0}; Point(22) = {-10,11,0}; Point(23) = {10,11,0}; Point(24) = {17,11,0};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,14}; Line(14) = {14,11};
Line(15) = {15,16}; Line(16) = {16,17}; Line(17) = {17,18}; Line(18) = {18,15};
Line(21) = {14,21}; Line(22) = {21,22}; Line(23) = {22,13}; Line(24) = {13,18}; Line(25) = {18,23}; Line(26) = {23,22}; Line(27) = {17,24}; Line(28) = {24,23};
Curve Loop(2) = {11:14}; Plane Surface(2) = {2};
Curve Loop(3) = {15:18}; Plane Surface(3) = {3};
Curve Loop(4) = {-13,-23,-22,-21}; Plane Surface(4) = {4};
Curve Loop(5) = {24,25,26,23}; Plane Surface(5) = {5};
Curve Loop(6) = {-17,27,28,-25}; Plane Surface(6) = {6};
Transfinite Curve {1,3,24,26} = 11; Transfinite Curve {2,4,12,14,16,18} = 6; Transfinite Curve {11,13,15,17,22,28} = 5; Transfinite Curve {21,23,25,27} = 4;
Transfinite Surface {1:6}; Recombine Surface {1:6};
r[] = Extrude {0,0,16} { Surface{1}; Layers{5}; Recombine; };
a[] = Extrude {0,0,16} { Surface{2}; Layers{5}; Recombine; };
b[] = Extrude {0,0,16} { Surface{3}; Layers{5}; Recombine; };
c[] = Extrude {0,0,16} { Surface{4}; Layers{5}; Recombine; };
d[] = Extrude {0,0,16} { Surface{5}; Layers{5}; Recombine; };
g[] = Extrude {0,0,16} { Surface{6}; Layers{5}; Recombine; };
Physical Volume("rail") = {r[1]}; Physical Volume("carriage") = {a[1],b[1],c[1],d[1],g[1]};
Physical Surface("rail_base") = {r[2]}; Physical Surface("rail_right") = {r[3]}; Physical Surface("rail_top") = {r[4]}; Physical Surface("rail_left") = {r[5]};
Physical Surface("leg_left") = {a[3]}; Physical Surface("side") = {a[5]}; Physical Surface("leg_right") = {b[5]};
Physical Surface("ceiling") = {d[2]}; Physical Surface("table") = {c[4],d[4],g[4]};
Physical Surface("front") = {2:6};
