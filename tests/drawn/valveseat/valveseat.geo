// A poppet valve on its conical seat, x is the radius, y the axis; second-order triangles (gmsh -order 2). mm.
Geometry.AutoCoherence = 0;
a = 1.6; f = 0.3; n = 12;
Point(1) = {0,0,0,a}; Point(2) = {12,0,0,f}; Point(3) = {15,3,0,f}; Point(4) = {15,5,0,0.9}; Point(5) = {3,5,0,a}; Point(6) = {3,14,0,a}; Point(7) = {0,14,0,a};
For i In {1:6}
  Line(i) = {i,i+1};
EndFor
Line(7) = {7,1};
Curve Loop(1) = {1:7}; Plane Surface(1) = {1};
Point(11) = {12,0,0,f}; Point(12) = {12,-5,0,a}; Point(13) = {21,-5,0,a}; Point(14) = {21,3,0,a}; Point(15) = {15,3,0,f};
For i In {11:14}
  Line(i) = {i,i+1};
EndFor
Line(15) = {15,11};
Curve Loop(2) = {11:15}; Plane Surface(2) = {2};
Transfinite Curve {2,15} = n+1;
Physical Surface("valve") = {1}; Physical Surface("seat") = {2};
Physical Curve("valve_cone") = {2}; Physical Curve("head") = {4}; Physical Curve("stem") = {6};
Physical Curve("seat_cone") = {15}; Physical Curve("seat_base") = {12}; Physical Curve("seat_out") = {13};
