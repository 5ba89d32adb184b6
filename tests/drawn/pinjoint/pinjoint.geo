// A lug on a pin, a quarter: x >= 0, z >= 0. The pin reaches from z = 0 to 8, the lug to 4. mm.
R = 5; L = 14; q = R*Sqrt(0.5); s = 2; n = 4; m = 8; k = 4; j = 3;
// lug: the hole's arc from -90 to 90 degrees
Point(1) = {0,0,0}; Point(2) = {0,-R,0}; Point(3) = {q,-q,0}; Point(4) = {q,q,0}; Point(5) = {0,R,0};
Point(6) = {0,-L,0}; Point(7) = {L,-L,0}; Point(8) = {L,L,0}; Point(9) = {0,L,0};
Circle(1) = {2,1,3}; Circle(2) = {3,1,4}; Circle(3) = {4,1,5};
Line(4) = {6,7}; Line(5) = {7,8}; Line(6) = {8,9};
Line(7) = {2,6}; Line(8) = {3,7}; Line(9) = {4,8}; Line(10) = {5,9};
Curve Loop(1) = {1,8,-4,-7}; Plane Surface(1) = {1};
Curve Loop(2) = {2,9,-5,-8}; Plane Surface(2) = {2};
Curve Loop(3) = {3,10,-6,-9}; Plane Surface(3) = {3};
// pin
Point(11) = {0,0,0}; P = R - 0.001; p = P*Sqrt(0.5); // so that gmsh does not merge pin and bore
Point(12) = {0,-P,0}; Point(13) = {p,-p,0}; Point(14) = {p,p,0}; Point(15) = {0,P,0};
Point(16) = {0,-s,0}; Point(17) = {s,-s,0}; Point(18) = {s,s,0}; Point(19) = {0,s,0};
Circle(11) = {12,11,13}; Circle(12) = {13,11,14}; Circle(13) = {14,11,15};
Line(14) = {16,17}; Line(15) = {17,18}; Line(16) = {18,19}; Line(21) = {19,16};
Line(17) = {12,16}; Line(18) = {13,17}; Line(19) = {14,18}; Line(20) = {15,19};
Curve Loop(11) = {11,18,-14,-17}; Plane Surface(11) = {11};
Curve Loop(12) = {12,19,-15,-18}; Plane Surface(12) = {12};
Curve Loop(13) = {13,20,-16,-19}; Plane Surface(13) = {13};
Curve Loop(14) = {14,15,16,21}; Plane Surface(14) = {14};
Transfinite Curve {1,3,4,6,11,13,14,16} = n+1; Transfinite Curve {2,5,12,15,21} = m+1;
Transfinite Curve {7:10} = k+1 Using Progression 1.3; Transfinite Curve {17:20} = j+1;
Transfinite Surface {1:3,11:14}; Recombine Surface {1:3,11:14};
l1[] = Extrude {0,0,4} { Surface{1}; Layers{4}; Recombine; };
l2[] = Extrude {0,0,4} { Surface{2}; Layers{4}; Recombine; };
l3[] = Extrude {0,0,4} { Surface{3}; Layers{4}; Recombine; };
p1[] = Extrude {0,0,4} { Surface{11}; Layers{4}; Recombine; };
p2[] = Extrude {0,0,4} { Surface{12}; Layers{4}; Recombine; };
p3[] = Extrude {0,0,4} { Surface{13}; Layers{4}; Recombine; };
p4[] = Extrude {0,0,4} { Surface{14}; Layers{4}; Recombine; };
q1[] = Extrude {0,0,4} { Surface{p1[0]}; Layers{3}; Recombine; };
q2[] = Extrude {0,0,4} { Surface{p2[0]}; Layers{3}; Recombine; };
q3[] = Extrude {0,0,4} { Surface{p3[0]}; Layers{3}; Recombine; };
q4[] = Extrude {0,0,4} { Surface{p4[0]}; Layers{3}; Recombine; };
Physical Volume("lug") = {l1[1],l2[1],l3[1]}; Physical Volume("pin") = {p1[1],p2[1],p3[1],p4[1],q1[1],q2[1],q3[1],q4[1]};
Physical Surface("hole") = {l1[2],l2[2],l3[2]}; Physical Surface("pin_round") = {p1[2],p2[2],p3[2]};
Physical Surface("lug_end") = {l1[4]}; Physical Surface("lug_x0") = {l1[5],l3[3]};
Physical Surface("pin_x0") = {p1[5],p3[3],p4[5],q1[5],q3[3],q4[5]};
Physical Surface("lug_z0") = {1:3}; Physical Surface("pin_z0") = {11:14};
Physical Surface("pin_end") = {q1[0],q2[0],q3[0],q4[0]};
