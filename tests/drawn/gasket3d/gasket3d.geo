// A blind cover on a flat gasket, three bolts at uneven angles. mm. O-grid of eight sectors.
n = 5;                 // elements per sector of 45 degrees
t = 12; g = 2; away = 5;   // the gasket is drawn below its place, so that gmsh does not merge it with the cover, and moved at the end
// --- the cover: square-like core, then rings r0 .. r5
r[] = {28, 38, 46, 54, 60}; m[] = {4, 5, 2, 3, 2};
q = 13;
Point(1) = {0,0,0};
For k In {0:7}
  a = k*Pi/4;
  s = (k % 2 == 0) ? q : q*1.2;
  Point(10+k) = {s*Cos(a), s*Sin(a), 0};
  For i In {0:4}
    Point(100+10*i+k) = {r[i]*Cos(a), r[i]*Sin(a), 0};
  EndFor
EndFor
For k In {0:7}
  l = (k+1) % 8;
  Line(10+k) = {10+k, 10+l}; Transfinite Curve {10+k} = n+1;
  Line(20+k) = {10+k, 100+k}; Transfinite Curve {20+k} = m[0]+1;
  For i In {0:4}
    Circle(100+10*i+k) = {100+10*i+k, 1, 100+10*i+l}; Transfinite Curve {100+10*i+k} = n+1;
  EndFor
  For i In {0:3}
    Line(200+10*i+k) = {100+10*i+k, 110+10*i+k}; Transfinite Curve {200+10*i+k} = m[i+1]+1;
  EndFor
EndFor
For k In {0:3}
  Line(30+k) = {1, 10+2*k}; Transfinite Curve {30+k} = n+1;
EndFor
For k In {0:3}
  l = (k+1) % 4;
  Curve Loop(30+k) = {30+k, 10+2*k, 11+2*k, -(30+l)}; Plane Surface(30+k) = {30+k};
EndFor
For k In {0:7}
  l = (k+1) % 8;
  Curve Loop(20+k) = {20+k, 100+k, -(20+l), -(10+k)}; Plane Surface(20+k) = {20+k};
  For i In {0:3}
    Curve Loop(200+10*i+k) = {200+10*i+k, 110+10*i+k, -(200+10*i+l), -(100+10*i+k)}; Plane Surface(200+10*i+k) = {200+10*i+k};
  EndFor
EndFor
cs[] = {30:33, 20:27, 200:207, 210:217, 220:227, 230:237};
Transfinite Surface {cs[]}; Recombine Surface {cs[]};
wet[] = {30:33, 20:27}; under[] = {200:207};
top[] = {}; vol[] = {}; bolt1[] = {}; bolt2[] = {}; bolt3[] = {};
For i In {0:#cs[]-1}
  e[] = Extrude {0,0,t} { Surface{cs[i]}; Layers{3}; Recombine; };
  vol[] += e[1]; top[] += e[0];
  If (cs[i] == 220) bolt1[] += e[0]; EndIf
  If (cs[i] == 223) bolt2[] += e[0]; EndIf
  If (cs[i] == 225) bolt3[] += e[0]; EndIf
EndFor
// --- the gasket, below
Point(9500) = {0,0,-g-away};
For k In {0:7}
  a = k*Pi/4;
  Point(9510+k) = {28*Cos(a), 28*Sin(a), -g-away}; Point(9520+k) = {38*Cos(a), 38*Sin(a), -g-away};
EndFor
For k In {0:7}
  l = (k+1) % 8;
  Circle(9510+k) = {9510+k, 9500, 9510+l}; Circle(9520+k) = {9520+k, 9500, 9520+l}; Line(9530+k) = {9510+k, 9520+k};
  Transfinite Curve {9510+k, 9520+k} = n+1; Transfinite Curve {9530+k} = 6;
EndFor
gv[] = {}; gt[] = {}; gin[] = {};
For k In {0:7}
  l = (k+1) % 8;
  Curve Loop(9510+k) = {9530+k, 9520+k, -(9530+l), -(9510+k)}; Plane Surface(9510+k) = {9510+k};
  Transfinite Surface {9510+k}; Recombine Surface {9510+k};
  e[] = Extrude {0,0,g} { Surface{9510+k}; Layers{4}; Recombine; };
  gv[] += e[1]; gt[] += e[0]; gin[] += e[5];
EndFor
Geometry.AutoCoherence = 0;
Translate {0,0,away} { Volume{gv[]}; }
Physical Volume("cover") = {vol[]}; Physical Volume("gasket") = {gv[]};
Physical Surface("cover_wet") = {wet[]}; Physical Surface("cover_seat") = {under[]}; 
Physical Surface("bolt1") = {bolt1[]}; Physical Surface("bolt2") = {bolt2[]}; Physical Surface("bolt3") = {bolt3[]};
Physical Surface("gasket_top") = {gt[]}; Physical Surface("gasket_base") = {9510:9517}; Physical Surface("gasket_bore") = {gin[]};
