// A domed aluminium pad (half) under a steel plate. mm.
R = 30; H = 8; W = 8; yc = H - R; ye = yc + Sqrt(R^2 - W^2);
Point(1) = {0, 0, 0}; Point(2) = {W, 0, 0}; Point(3) = {W, ye, 0}; Point(4) = {0, H, 0}; Point(5) = {0, yc, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Circle(3) = {3, 5, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Transfinite Curve {1} = 21 Using Progression 1.04; Transfinite Curve {-3} = 21 Using Progression 1.04;
Transfinite Curve {2, -4} = 13 Using Progression 0.93;
Transfinite Surface {1}; Recombine Surface {1};
Point(11) = {0, H, 0}; Point(12) = {10, H, 0}; Point(13) = {10, H + 5, 0}; Point(14) = {0, H + 5, 0};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 11};
Curve Loop(2) = {11:14}; Plane Surface(2) = {2};
Transfinite Curve {11} = 21 Using Progression 1.03; Transfinite Curve {-13} = 21 Using Progression 1.03; Transfinite Curve {12, 14} = 6;
Transfinite Surface {2}; Recombine Surface {2};
Physical Surface("pad") = {1}; Physical Surface("plate") = {2};
Physical Curve("pad_base") = {1}; Physical Curve("pad_top") = {3}; Physical Curve("plate_under") = {11}; Physical Curve("plate_top") = {13};
Physical Curve("sym") = {4, 14};
