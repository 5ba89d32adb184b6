// A thrust washer, loose between a housing with a lip and a collar: axisymmetric section, x the radius, y the axis. mm.
Geometry.AutoCoherence = 0;
// housing: seat below the washer, corner and lip
Point(1) = {20,-12,0}; Point(2) = {24,-12,0}; Point(3) = {36,-12,0}; Point(4) = {44,-12,0};
Point(5) = {20,0,0}; Point(6) = {24,0,0}; Point(7) = {36,0,0}; Point(8) = {44,0,0}; Point(9) = {36,4,0}; Point(10) = {44,4,0};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {5,6}; Line(5) = {6,7}; Line(6) = {7,8};
Line(7) = {1,5}; Line(8) = {2,6}; Line(9) = {3,7}; Line(10) = {4,8}; Line(11) = {7,9}; Line(12) = {8,10}; Line(13) = {9,10};
Curve Loop(1) = {1,8,-4,-7}; Plane Surface(1) = {1};
Curve Loop(2) = {2,9,-5,-8}; Plane Surface(2) = {2};
Curve Loop(3) = {3,10,-6,-9}; Plane Surface(3) = {3};
Curve Loop(4) = {6,12,-13,-11}; Plane Surface(4) = {4};
// washer
Point(21) = {24,0,0}; Point(22) = {36,0,0}; Point(23) = {36,4,0}; Point(24) = {24,4,0};
Line(21) = {21,22}; Line(22) = {22,23}; Line(23) = {23,24}; Line(24) = {24,21};
Curve Loop(21) = {21,22,23,24}; Plane Surface(21) = {21};
// collar, narrower than the lip's bore, wider inwards
Point(31) = {18,4,0}; Point(32) = {24,4,0}; Point(33) = {36,4,0}; Point(34) = {18,14,0}; Point(35) = {24,14,0}; Point(36) = {36,14,0};
Line(31) = {31,32}; Line(32) = {32,33}; Line(33) = {34,35}; Line(34) = {35,36}; Line(35) = {31,34}; Line(36) = {32,35}; Line(37) = {33,36};
Curve Loop(31) = {31,36,-33,-35}; Plane Surface(31) = {31};
Curve Loop(32) = {32,37,-34,-36}; Plane Surface(32) = {32};
Transfinite Curve {1,4} = 5; Transfinite Curve {2,5,21,23,32,34} = 25; Transfinite Curve {3,6,13} = 9;
Transfinite Curve {7,8,9,10} = 13; Transfinite Curve {11,12,22,24} = 9; Transfinite Curve {31,33} = 7; Transfinite Curve {35,36,37} = 13;
Transfinite Surface {1,2,3,4,21,31,32}; Recombine Surface {1,2,3,4,21,31,32};
Physical Surface("housing") = {1,2,3,4}; Physical Surface("washer") = {21}; Physical Surface("collar") = {31,32};
Physical Curve("housing_base") = {1,2,3}; Physical Curve("seat") = {5}; Physical Curve("lip") = {11};
Physical Curve("washer_under") = {21}; Physical Curve("washer_top") = {23}; Physical Curve("washer_out") = {22};
Physical Curve("collar_under") = {32}; Physical Curve("shaft_side") = {33}; Physical Curve("washer_bore") = {24};
