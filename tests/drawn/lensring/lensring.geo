// Section (x radius, y axis) of a lens ring between two flanges; meshes of the three do not match. mm. gmsh -2 lensring.geo
// The ring is drawn as a rectangle [50,58] x [0,6]; the scene's map crowns it. Flanges [44,66] x [6,18] and x [-12,0], drawn 0.
DefineConstant[ nr = {40}, nh = {24}, nf = {61}, ng = {47}, nt = {20} ];
Macro Rectang  // x0 x1 y0 y1, n along x, m along y, o first tag
  Point(o) = {x0,y0,0}; Point(o+1) = {x1,y0,0}; Point(o+2) = {x1,y1,0}; Point(o+3) = {x0,y1,0};
  Line(o) = {o,o+1}; Line(o+1) = {o+1,o+2}; Line(o+2) = {o+2,o+3}; Line(o+3) = {o+3,o};
  Curve Loop(o) = {o,o+1,o+2,o+3}; Plane Surface(o) = {o};
  Transfinite Curve {o,o+2} = n+1; Transfinite Curve {o+1,o+3} = m+1;
  Transfinite Surface {o}; Recombine Surface {o};
Return
// the ring, its top in three parts: the middle one is the seat [53, 55]
Point(1) = {50,0,0}; Point(2) = {58,0,0}; Point(3) = {58,6,0}; Point(4) = {50,6,0}; Point(5) = {55,6,0}; Point(6) = {53,6,0};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,5}; Line(4) = {5,6}; Line(5) = {6,4}; Line(6) = {4,1};
Curve Loop(1) = {1:6}; Plane Surface(1) = {1};
Transfinite Curve {1} = nr+1; Transfinite Curve {2,6} = nh+1; Transfinite Curve {3,5} = 3*nr/8+1; Transfinite Curve {4} = nr/4+1;
Transfinite Surface {1} = {1,2,3,4}; Recombine Surface {1};
o = 11; x0 = 44; x1 = 66; y0 = 6; y1 = 18; n = nf; m = nt; Call Rectang;
o = 21; x0 = 44; x1 = 66; y0 = -12; y1 = 0; n = ng; m = nt; Call Rectang;
Physical Surface("ring") = {1};
Physical Surface("upper") = {11};
Physical Surface("lower") = {21};
Physical Curve("ring_under") = {1};
Physical Curve("ring_seat") = {4};
Physical Curve("ring_sides") = {3,5};
Physical Curve("ring_bore") = {6};
Physical Curve("upper_under") = {11};
Physical Curve("upper_top") = {13};
Physical Curve("lower_top") = {23};
Physical Curve("lower_base") = {21};
Physical Curve("ring_top") = {3,4,5};
