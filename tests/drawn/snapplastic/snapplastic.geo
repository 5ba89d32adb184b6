// A tongue, clamped left. mm.
Point(1) = {0,0,0}; Point(2) = {8,0,0}; Point(3) = {12,0,0}; Point(4) = {20,0,0}; Point(5) = {20,1.5,0}; Point(6) = {14,1.5,0}; Point(7) = {0,1.5,0};
For i In {1:6}
  Line(i) = {i,i+1};
EndFor
Line(7) = {7,1};
Curve Loop(1) = {1:7}; Plane Surface(1) = {1};
Transfinite Curve {1} = 25; Transfinite Curve {2} = 13; Transfinite Curve {3} = 25; Transfinite Curve {4,7} = 6; Transfinite Curve {5} = 19; Transfinite Curve {6} = 43;
Transfinite Surface {1} = {1,4,5,7}; Recombine Surface {1};
Physical Surface("tongue") = {1};
Physical Curve("clamp") = {7}; Physical Curve("back") = {2}; Physical Curve("nose") = {5}; Physical Curve("end") = {4};
