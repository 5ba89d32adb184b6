// A piston ring in its groove against the liner; x is the radius, y the axis. mm.
Geometry.AutoCoherence = 0;
ri = 37; ro = 40; hr = 2; g = 39.6; n = 12; m = 2; k = 8;
Point(1) = {ri,0,0}; Point(2) = {g,0,0}; Point(3) = {ro,0,0}; Point(4) = {ro,hr,0}; Point(5) = {g,hr,0}; Point(6) = {ri,hr,0};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,5}; Line(5) = {5,6}; Line(6) = {6,1};
Curve Loop(1) = {1:6}; Plane Surface(1) = {1};
Transfinite Curve {1,5} = n+1; Transfinite Curve {2,4} = m+1; Transfinite Curve {3,6} = k+1;
Transfinite Surface {1} = {1,3,4,6};
// piston with groove
Point(11) = {30,-4,0,0.9}; Point(12) = {g,-4,0,0.9}; Point(13) = {g,0,0,0.25}; Point(14) = {ri,0,0,0.25}; Point(15) = {36.5,0,0,0.4};
Point(16) = {36.5,hr,0,0.4}; Point(17) = {ri,hr,0,0.25}; Point(18) = {g,hr,0,0.25}; Point(19) = {g,hr+4,0,0.9}; Point(20) = {30,hr+4,0,0.9};
For i In {11:19}
  Line(i) = {i,i+1};
EndFor
Line(20) = {20,11};
Curve Loop(2) = {11:20}; Plane Surface(2) = {2};
Transfinite Curve {13,17} = n+1;
// liner
Point(31) = {ro,-4,0,0.8}; Point(32) = {44,-4,0,1}; Point(33) = {44,6,0,1}; Point(34) = {ro,6,0,0.8}; Point(35) = {ro,hr,0,0.25}; Point(36) = {ro,0,0,0.25};
For i In {31:35}
  Line(i) = {i,i+1};
EndFor
Line(36) = {36,31};
Curve Loop(3) = {31:36}; Plane Surface(3) = {3};
Transfinite Curve {35} = k+1;
Recombine Surface {1,2,3};
Physical Surface("ring") = {1}; Physical Surface("piston") = {2}; Physical Surface("liner") = {3};
Physical Curve("ring_low") = {1}; Physical Curve("ring_up") = {5}; Physical Curve("ring_top") = {4,5}; Physical Curve("ring_face") = {3}; Physical Curve("ring_back") = {6};
Physical Curve("groove_low") = {13}; Physical Curve("groove_up") = {17}; Physical Curve("piston_base") = {11};
Physical Curve("liner_face") = {35}; Physical Curve("liner_base") = {31};
