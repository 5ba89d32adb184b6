// A screw cap on a seat ring, the half y > 0, structured hexahedra; the two annuli of contact coincide and match.
// gmsh -3 cap.geo -setnumber m 8 -o cap.msh      m: elements per 90 degrees; 3/4 m across the annulus of contact
Geometry.AutoCoherence = 0;
DefineConstant[ m = {8, Name "Size"} ];
nc = Round(0.75*m);  ni = Round(0.25*m);  no = Round(0.35*m);  nz = Round(0.45*m);
// section: 1 ... 6 the cap, 7 ... 12 the seat
r[] = {0, 2, 5, 10, 10, 5, 2,  5, 10, 14, 14, 10, 5};
z[] = {0, 0, 0, 0, 5, 5, 5,    0, 0, 0, -4, -4, -4};
Point(901) = {0, 0, 0};  Point(902) = {0, 0, 5};  Point(903) = {0, 0, -4};
a[] = {0, 1, 2, 3, 4, 5, 6, 2,  7, 8, 9, 10, 11, 12, 8};
b[] = {0, 2, 3, 4, 5, 6, 1, 5,  8, 9, 10, 11, 12, 7, 11};
e[] = {0, ni, nc, nz, nc, ni, nz, nz,  nc, no, nz, no, nc, nz, nz};
For k In {0:2}
  o = 100*k;
  For j In {1:12}
    Point(o+j) = {r[j]*Cos(k*Pi/2), r[j]*Sin(k*Pi/2), z[j]};
  EndFor
  For c In {1:14}
    Line(o+c) = {o+a[c], o+b[c]};
    Transfinite Curve {o+c} = e[c]+1;
  EndFor
  Curve Loop(o+1) = {o+1, o+7, o+5, o+6};         Plane Surface(o+1) = {o+1};
  Curve Loop(o+2) = {o+2, o+3, o+4, -(o+7)};      Plane Surface(o+2) = {o+2};
  Curve Loop(o+3) = {o+8, o+14, o+12, o+13};      Plane Surface(o+3) = {o+3};
  Curve Loop(o+4) = {o+9, o+10, o+11, -(o+14)};   Plane Surface(o+4) = {o+4};
EndFor
For k In {0:1}
  o = 100*k;  t = o+100;  v = 1000*(k+1);
  For j In {1:12}
    Circle(v+j) = {o+j, (z[j] == 0 ? 901 : (z[j] > 0 ? 902 : 903)), t+j};
    Transfinite Curve {v+j} = m+1;
  EndFor
  For c In {1:14}
    Curve Loop(v+c) = {o+c, v+b[c], -(t+c), -(v+a[c])};  Surface(v+c) = {v+c};
    Transfinite Surface {v+c};
  EndFor
  Surface Loop(v+1) = {o+1, t+1, v+1, v+7, v+5, v+6};       Volume(v+1) = {v+1};
  Surface Loop(v+2) = {o+2, t+2, v+2, v+3, v+4, v+7};       Volume(v+2) = {v+2};
  Surface Loop(v+3) = {o+3, t+3, v+8, v+14, v+12, v+13};    Volume(v+3) = {v+3};
  Surface Loop(v+4) = {o+4, t+4, v+9, v+10, v+11, v+14};    Volume(v+4) = {v+4};
EndFor
Transfinite Surface {1:4, 101:104, 201:204};
Transfinite Volume {:};
Recombine Surface {:};
Physical Volume("cap", 1) = {1001, 1002, 2001, 2002};
Physical Volume("seat", 2) = {1003, 1004, 2003, 2004};
Physical Surface("shank", 11) = {1001, 2001};
Physical Surface("bead", 12) = {1002, 2002};
Physical Surface("seat_top", 13) = {1008, 2008};
Physical Surface("seat_base", 14) = {1011, 2011, 1012, 2012};
Physical Surface("sym_y0", 15) = {1:4, 201:204};
