// A leaf spring, clamped left, drawn flat; a small cell carries the rigid punch. mm.
L = 60; t = 2;
Point(1) = {0,0,0}; Point(2) = {26,0,0}; Point(3) = {34,0,0}; Point(4) = {54,0,0}; Point(5) = {L,0,0};
Point(6) = {L,t,0}; Point(7) = {0,t,0};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,5}; Line(5) = {5,6}; Line(6) = {6,7}; Line(7) = {7,1};
Curve Loop(1) = {1:7}; Plane Surface(1) = {1};
Transfinite Curve {1} = 105; Transfinite Curve {2} = 33; Transfinite Curve {3} = 81; Transfinite Curve {4} = 25;
Transfinite Curve {6} = 241; Transfinite Curve {5,7} = 5;
Transfinite Surface {1} = {1,5,6,7};
Point(11) = {30,10,0}; Point(12) = {31,10,0}; Point(13) = {31,11,0}; Point(14) = {30,11,0};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,14}; Line(14) = {14,11};
Curve Loop(2) = {11:14}; Plane Surface(2) = {2};
Transfinite Curve {11:14} = 2; Transfinite Surface {2};
Recombine Surface {1,2};
Physical Surface("leaf") = {1}; Physical Surface("tool") = {2};
Physical Curve("clamp") = {7}; Physical Curve("top") = {6};
Physical Curve("under_mid") = {2}; Physical Curve("under_end") = {4}; Physical Curve("end_face") = {5};
Physical Point("tip") = {11};
