// A key in the keyways of shaft (below) and hub (above), section; the key is held by contact alone. mm.
Geometry.AutoCoherence = 0;
h = 2.2; f = 0.65; w = 4; t = 4; e = 0.25; W = 16; H = 14;
// key
Point(1) = {-w,-t,0,f}; Point(2) = {w,-t,0,f}; Point(3) = {w,-e,0,f}; Point(4) = {w,e,0,f};
Point(5) = {w,t,0,f}; Point(6) = {-w,t,0,f}; Point(7) = {-w,e,0,f}; Point(8) = {-w,-e,0,f};
For i In {1:7}
  Line(i) = {i,i+1};
EndFor
Line(8) = {8,1};
Curve Loop(1) = {1:8}; Plane Surface(1) = {1};
// shaft
Point(11) = {-W,-H,0,h}; Point(12) = {W,-H,0,h}; Point(13) = {W,-e,0,h}; Point(14) = {w,-e,0,f};
Point(15) = {w,-t,0,f}; Point(16) = {-w,-t,0,f}; Point(17) = {-w,-e,0,f}; Point(18) = {-W,-e,0,h};
For i In {11:17}
  Line(i) = {i,i+1};
EndFor
Line(18) = {18,11};
Curve Loop(2) = {11:18}; Plane Surface(2) = {2};
// hub
Point(21) = {-W,H,0,h}; Point(22) = {W,H,0,h}; Point(23) = {W,e,0,h}; Point(24) = {w,e,0,f};
Point(25) = {w,t,0,f}; Point(26) = {-w,t,0,f}; Point(27) = {-w,e,0,f}; Point(28) = {-W,e,0,h};
For i In {21:27}
  Line(i) = {i,i+1};
EndFor
Line(28) = {28,21};
Curve Loop(3) = {21:28}; Plane Surface(3) = {3};
Transfinite Curve {1,5,15,25} = 13;
Transfinite Curve {2,8,4,6,14,16,24,26} = 7;
Transfinite Curve {3,7} = 2;
Transfinite Surface {1} = {1,2,5,6};
Recombine Surface {1,2,3};
Physical Surface("key") = {1}; Physical Surface("shaft") = {2}; Physical Surface("hub") = {3};
Physical Curve("key_bottom") = {1}; Physical Curve("key_top") = {5};
Physical Curve("key_right_low") = {2}; Physical Curve("key_right_up") = {4};
Physical Curve("key_left_up") = {6}; Physical Curve("key_left_low") = {8};
Physical Curve("shaft_base") = {11}; Physical Curve("shaft_floor") = {15};
Physical Curve("shaft_right") = {14}; Physical Curve("shaft_left") = {16};
Physical Curve("hub_back") = {21}; Physical Curve("hub_ceiling") = {25};
Physical Curve("hub_right") = {24}; Physical Curve("hub_left") = {26};
