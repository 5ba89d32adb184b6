// A plate on two elastic bearers, and a crowned polymer pad that travels along it, off the plate's middle. mm.
a = 40; w = 12; t = 6; c = 8; d = 6; p = 8; off = 3;
Point(1) = {-a,-w,-t}; Point(2) = {a,-w,-t}; Point(3) = {a,w,-t}; Point(4) = {-a,w,-t};
// the underside is cut into two bearers and the free span
Point(5) = {-a+10,-w,-t}; Point(6) = {a-10,-w,-t}; Point(7) = {a-10,w,-t}; Point(8) = {-a+10,w,-t};
Line(1) = {1,5}; Line(2) = {5,6}; Line(3) = {6,2}; Line(4) = {2,3}; Line(5) = {3,7}; Line(6) = {7,8}; Line(7) = {8,4}; Line(8) = {4,1};
Line(9) = {5,8}; Line(10) = {6,7};
Curve Loop(1) = {1,9,7,8}; Plane Surface(1) = {1};
Curve Loop(2) = {2,10,6,-9}; Plane Surface(2) = {2};
Curve Loop(3) = {3,4,5,-10}; Plane Surface(3) = {3};
Transfinite Curve {1,7,3,5} = 9; Transfinite Curve {2,6} = 49; Transfinite Curve {4,8,9,10} = 21;
Transfinite Surface {1,2,3}; Recombine Surface {1,2,3};
pl[] = Extrude {0,0,t} { Surface{1,2,3}; Layers{4}; Recombine; };
// the pad, drawn flat; the scene's map gives it its crown
Point(901) = {-c,off-d,0}; Point(902) = {c,off-d,0}; Point(903) = {c,off+d,0}; Point(904) = {-c,off+d,0};
Line(901) = {901,902}; Line(902) = {902,903}; Line(903) = {903,904}; Line(904) = {904,901};
Curve Loop(901) = {901,902,903,904}; Plane Surface(901) = {901};
Transfinite Curve {901,903} = 23; Transfinite Curve {902,904} = 17;
Transfinite Surface {901}; Recombine Surface {901};
pd[] = Extrude {0,0,p} { Surface{901}; Layers{8}; Recombine; };
Physical Volume("plate") = {pl[1],pl[7],pl[13]};
Physical Volume("pad") = {pd[1]};
Physical Surface("plate_top") = {pl[0],pl[6],pl[12]};
Physical Surface("bearer_left") = {1}; Physical Surface("bearer_right") = {3};
Physical Surface("span") = {2};
Physical Surface("pad_sole") = {901}; Physical Surface("pad_top") = {pd[0]};
Physical Curve("end_left") = {8};
