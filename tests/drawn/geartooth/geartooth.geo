// Two teeth with convex flanks of radius 20 (driver, root below) and 15 (driven, root above) that touch at the origin. mm.
Geometry.AutoCoherence = 0;
h = 6; c = 1; f = 0.13;
a = -20 + Sqrt(400 - h*h); b = 15 - Sqrt(225 - h*h);
Point(1) = {-20,0,0}; Point(2) = {a,-h,0,f}; Point(3) = {a,h,0,f}; Point(4) = {-4.5,h,0,c}; Point(5) = {-9,-h,0,c};
Circle(1) = {2,1,3}; Line(2) = {3,4}; Line(3) = {4,5}; Line(4) = {5,2};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
H = 7; d = 15 - Sqrt(225 - H*H);
Point(11) = {15,0,0}; Point(12) = {d,-H,0,f}; Point(13) = {d,H,0,f}; Point(14) = {10,H,0,c}; Point(15) = {5,-H,0,c};
Circle(11) = {12,11,13}; Line(12) = {13,14}; Line(13) = {14,15}; Line(14) = {15,12};
Curve Loop(2) = {11:14}; Plane Surface(2) = {2};
Transfinite Curve {1} = 97; Transfinite Curve {11} = 121;
Recombine Surface {1,2};
Physical Surface("driver") = {1}; Physical Surface("driven") = {2};
Physical Curve("driver_root") = {4}; Physical Curve("driver_flank") = {1};
Physical Curve("driven_root") = {12}; Physical Curve("driven_flank") = {11};
