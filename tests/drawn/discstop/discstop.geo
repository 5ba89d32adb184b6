// A clamped disc over a central stop: x is the radius, y the axis. mm.
R = 30; t = 3; r = 8; d = 6;
Point(1) = {0, 0, 0}; Point(2) = {r, 0, 0}; Point(3) = {R, 0, 0}; Point(4) = {R, t, 0}; Point(5) = {r, t, 0}; Point(6) = {0, t, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1}; Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6}; Plane Surface(1) = {1};
Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(2) = {2};
Transfinite Curve {1, 5} = 17; Transfinite Curve {2, 4} = 33; Transfinite Curve {3, 6, 7} = 7;
Point(11) = {0, -d, 0}; Point(12) = {r, -d, 0}; Point(13) = {r, 0, 0}; Point(14) = {0, 0, 0};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 11};
Curve Loop(3) = {11:14}; Plane Surface(3) = {3};
Transfinite Curve {11, 13} = 17; Transfinite Curve {12, 14} = 9;
Transfinite Surface {1, 2, 3}; Recombine Surface {1, 2, 3};
Physical Surface("disc") = {1, 2}; Physical Surface("stop") = {3};
Physical Curve("disc_mid") = {1}; Physical Curve("rim") = {3}; Physical Curve("disc_top") = {4, 5};
Physical Curve("stop_top") = {13}; Physical Curve("stop_base") = {11};
