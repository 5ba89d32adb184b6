// A guide shoe (steel carrier, polymer liner with a crowned sole) passes the joint of two rails. mm.
Geometry.AutoCoherence = 0;
L = 80; j = 0.6; h = 10;       // each rail, half of the joint, height
// rail A, left
Point(1) = {-L, -h, 0}; Point(2) = {-j, -h, 0}; Point(3) = {-j, 0, 0}; Point(4) = {-L, 0, 0};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Curve Loop(1) = {1,2,3,4}; Plane Surface(1) = {1};
// rail B, right
Point(11) = {j, -h, 0}; Point(12) = {L, -h, 0}; Point(13) = {L, 0, 0}; Point(14) = {j, 0, 0};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,14}; Line(14) = {14,11};
Curve Loop(11) = {11,12,13,14}; Plane Surface(11) = {11};
Transfinite Curve {1,3,11,13} = 181; Transfinite Curve {2,4,12,14} = 19;
// the shoe: liner of 3 mm under a carrier of 12 mm; sole of radius R, half width b
R = 250; b = 15; c = R - Sqrt(R*R - b*b);
Point(21) = {-b, c, 0}; Point(22) = {b, c, 0}; Point(23) = {0, R, 0};
Point(24) = {b, 3.5, 0}; Point(25) = {-b, 3.5, 0}; Point(26) = {b, 15, 0}; Point(27) = {-b, 15, 0};
Circle(21) = {21, 23, 22};
Line(22) = {22,24}; Line(23) = {24,25}; Line(24) = {25,21};
Line(25) = {24,26}; Line(26) = {26,27}; Line(27) = {27,25};
Curve Loop(21) = {21,22,23,24}; Plane Surface(21) = {21};
Curve Loop(22) = {-23,25,26,27}; Plane Surface(22) = {22};
Transfinite Curve {21,23,26} = 121; Transfinite Curve {22,24} = 11; Transfinite Curve {25,27} = 21;
Transfinite Surface {1,11,21,22}; Recombine Surface {1,11,21,22};
Physical Surface("railA") = {1}; Physical Surface("railB") = {11};
Physical Surface("shoe") = {21,22};
Physical Curve("rail_top") = {3,13};
Physical Curve("endA") = {4}; Physical Curve("endB") = {12};
Physical Curve("bedA") = {1}; Physical Curve("bedB") = {11};
Physical Curve("sole") = {21}; Physical Curve("carrier_top") = {26};
Physical Point("lipA") = {3}; Physical Point("lipB") = {14};
