// Half (y >= 0) of two square plates with a hole, clamped by a hollow bolt: nut and shank are one body with the head; the nut is grown onto the lower plate.
// z: nut -8..-4, lower plate -4..0, upper plate 0..4 (drawn 1e-3 higher), head 4..8. mm. gmsh -3 boltlap.geo
// na: elements of an eighth of the circle on the lower plate and bolt, nb: on the upper plate
Geometry.AutoCoherence = 0;
DefineConstant[ na = {2}, nb = {3}, e = {0.001} ];
r0 = 1.5; r1 = 3; r2 = 4; r3 = 7; A = 12;
Macro Ring    // sectors of 45 degrees between radii ra and rb (rb < 0: the square of half width A) at height zz; n, m: along, across; appends to s[]
  For k In {0:3}
    p = newp;
    a0 = k*Pi/4; a1 = (k+1)*Pi/4;
    Point(p) = {0,0,zz};
    Point(p+1) = {ra*Cos(a0), ra*Sin(a0), zz}; Point(p+2) = {ra*Cos(a1), ra*Sin(a1), zz};
    If (rb > 0)
      Point(p+3) = {rb*Cos(a0), rb*Sin(a0), zz}; Point(p+4) = {rb*Cos(a1), rb*Sin(a1), zz};
    Else
      f0 = A/(Fabs(Cos(a0)) > Fabs(Sin(a0)) ? Fabs(Cos(a0)) : Fabs(Sin(a0)));
      f1 = A/(Fabs(Cos(a1)) > Fabs(Sin(a1)) ? Fabs(Cos(a1)) : Fabs(Sin(a1)));
      Point(p+3) = {f0*Cos(a0), f0*Sin(a0), zz}; Point(p+4) = {f1*Cos(a1), f1*Sin(a1), zz};
    EndIf
    l = newl;
    Circle(l) = {p+1,p,p+2};
    Line(l+1) = {p+2,p+4};
    If (rb > 0)
      Circle(l+2) = {p+4,p,p+3};
    Else
      Line(l+2) = {p+4,p+3};
    EndIf
    Line(l+3) = {p+3,p+1};
    Curve Loop(l+4) = {l,l+1,l+2,l+3};
    q = news;
    Plane Surface(q) = {l+4};
    Transfinite Curve {l,l+2} = n+1; Transfinite Curve {l+1,l+3} = m+1;
    Transfinite Surface {q}; Recombine Surface {q};
    s[] += {q};
  EndFor
Return
lower[] = {}; upper[] = {};
// nut
s[] = {}; n = na; zz = -8; ra = r0; rb = r1; m = 2; Call Ring;
ra = r1; rb = r2; m = 1; Call Ring;
ra = r2; rb = r3; m = 3; Call Ring;
For i In {0:#s[]-1}
  v[] = Extrude {0,0,4} { Surface{s[i]}; Layers{2}; Recombine; }; lower[] += {v[1]};
EndFor
// lower plate
s[] = {}; zz = -4; ra = r2; rb = r3; m = 3; Call Ring;
ra = r3; rb = -1; m = 4; Call Ring;
For i In {0:#s[]-1}
  v[] = Extrude {0,0,4} { Surface{s[i]}; Layers{3}; Recombine; }; lower[] += {v[1]};
EndFor
// shank
s[] = {}; zz = -4; ra = r0; rb = r1; m = 2; Call Ring;
For i In {0:#s[]-1}
  v[] = Extrude {0,0,8+2*e} { Surface{s[i]}; Layers{6}; Recombine; }; lower[] += {v[1]};
EndFor
// head
s[] = {}; zz = 4+2*e; ra = r0; rb = r1; m = 2; Call Ring;
ra = r1; rb = r2; m = 1; Call Ring;
ra = r2; rb = r3; m = 3; Call Ring;
For i In {0:#s[]-1}
  v[] = Extrude {0,0,4} { Surface{s[i]}; Layers{2}; Recombine; }; lower[] += {v[1]};
EndFor
// upper plate
s[] = {}; n = nb; zz = e; ra = r2; rb = r3; m = 4; Call Ring;
ra = r3; rb = -1; m = 5; Call Ring;
For i In {0:#s[]-1}
  v[] = Extrude {0,0,4} { Surface{s[i]}; Layers{3}; Recombine; }; upper[] += {v[1]};
EndFor
Coherence;
Physical Volume("lower") = {lower[]};
Physical Volume("upper") = {upper[]};
d = 1e-4;
sy[] = Surface In BoundingBox {-A-d,-d,-8-d, A+d,d,8.1};
Physical Surface("sym") = {sy[]};
f[] = Surface In BoundingBox {-A-d,-d,-d, A+d,A+d,d};              Physical Surface("lower_face") = {f[]};
f[] = Surface In BoundingBox {-A-d,-d,e-d, A+d,A+d,e+d};           Physical Surface("upper_face") = {f[]};
f[] = Surface In BoundingBox {-r3-d,-d,4+e-d, r3+d,r3+d,4+e+d};       Physical Surface("upper_washer") = {f[]};
f[] = Surface In BoundingBox {-r3-d,-d,4+2*e-d, r3+d,r3+d,4+2*e+d}; 
g[] = Surface In BoundingBox {-r1-d,-d,4+2*e-d, r1+d,r1+d,4+2*e+d}; f[] -= g[];
g[] = Surface In BoundingBox {-r2-d,-d,4+2*e-d, r2+d,r2+d,4+2*e+d}; f[] -= g[];
Physical Surface("head_under") = {f[]};
f[] = Surface In BoundingBox {-A-d,-d,-4-d, -A+d,A+d,d};           Physical Surface("lower_end") = {f[]};
f[] = Surface In BoundingBox {A-d,-d,e-d, A+d,A+d,4+e+d};          Physical Surface("upper_end") = {f[]};
