// The section of an O-ring, centre at (R, 0); an O-grid of quadrilaterals. mm.
R = 20; r = 2.65; s = 1.2; n = 16; m = 9; q = Sqrt(0.5);
Point(1) = {R,0,0};
Point(2) = {R-s*q*1.2,-s*q*1.2,0}; Point(3) = {R+s*q*1.2,-s*q*1.2,0}; Point(4) = {R+s*q*1.2,s*q*1.2,0}; Point(5) = {R-s*q*1.2,s*q*1.2,0};
Point(12) = {R-r*q,-r*q,0}; Point(13) = {R+r*q,-r*q,0}; Point(14) = {R+r*q,r*q,0}; Point(15) = {R-r*q,r*q,0};
Line(1) = {2,3}; Line(2) = {3,4}; Line(3) = {4,5}; Line(4) = {5,2};
Circle(11) = {12,1,13}; Circle(12) = {13,1,14}; Circle(13) = {14,1,15}; Circle(14) = {15,1,12};
Line(21) = {2,12}; Line(22) = {3,13}; Line(23) = {4,14}; Line(24) = {5,15};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Curve Loop(2) = {11,-22,-1,21}; Plane Surface(2) = {2};
Curve Loop(3) = {12,-23,-2,22}; Plane Surface(3) = {3};
Curve Loop(4) = {13,-24,-3,23}; Plane Surface(4) = {4};
Curve Loop(5) = {14,-21,-4,24}; Plane Surface(5) = {5};
Transfinite Curve {1:4,11:14} = n+1; Transfinite Curve {21:24} = m+1;
Transfinite Surface {1:5}; Recombine Surface {1:5};
Physical Surface("rubber") = {1:5};
Physical Curve("bottom") = {11}; Physical Curve("outer") = {12}; Physical Curve("top") = {13}; Physical Curve("inner") = {14};
Physical Point("crest") = {4};
