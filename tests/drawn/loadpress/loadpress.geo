// A bearing ball pressed into a raceway: axisymmetric, x the radius, y the axis. mm.
Geometry.AutoCoherence = 0;
Point(1) = {0,-6,0}; Point(2) = {1.6,-6,0}; Point(3) = {7,-6,0}; Point(4) = {7,0,0}; Point(5) = {1.6,0,0}; Point(6) = {0,0,0};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,5}; Line(5) = {5,6}; Line(6) = {6,1}; Line(7) = {2,5};
Curve Loop(1) = {1,7,5,6}; Plane Surface(1) = {1};
Curve Loop(2) = {2,3,4,-7}; Plane Surface(2) = {2};
Transfinite Curve {1,5} = 25;
Transfinite Curve {2} = 13 Using Progression 1.22; Transfinite Curve {4} = 13 Using Progression 1/1.22;
Transfinite Curve {7,3} = 25 Using Progression 1/1.13; Transfinite Curve {6} = 25 Using Progression 1.13;
R = 6; b = 2; c = R - Sqrt(R*R-b*b);
Point(11) = {0,0,0}; Point(12) = {b,c,0}; Point(13) = {0,R,0}; Point(14) = {b,4,0}; Point(15) = {0,4,0};
Circle(11) = {11,13,12}; Line(12) = {12,14}; Line(13) = {14,15}; Line(14) = {15,11};
Curve Loop(11) = {11,12,13,14}; Plane Surface(11) = {11};
Transfinite Curve {11,13} = 36; Transfinite Curve {12} = 18 Using Progression 1.1; Transfinite Curve {14} = 18 Using Progression 1/1.1;
Transfinite Surface {1,2,11}; Recombine Surface {1,2,11};
Physical Surface("race") = {1,2}; Physical Surface("ball") = {11};
Physical Curve("race_top") = {5,4}; Physical Curve("race_base") = {1,2};
Physical Curve("ball_round") = {11}; Physical Curve("ball_top") = {13}; Physical Point("mark") = {6};
