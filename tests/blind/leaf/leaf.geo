// A leaf spring [0, 60] x [0, t], clamped on the left; structured quadrilaterals.
// gmsh -2 leaf.geo -setnumber h 0.8 -o leaf.msh      h: length of an element; there are 3.2/h of them through the thickness
DefineConstant[ h = {0.8, Name "Size"}, t = {2} ];
x[] = {0, 2, 52, 54, 60};
For i In {0:4}
  Point(1+i) = {x[i], 0, 0};
  Point(11+i) = {x[i], t, 0};
  Line(21+i) = {1+i, 11+i};
  Transfinite Curve {21+i} = Round(3.2/h)+1;
EndFor
For i In {0:3}
  n = Ceil((x[i+1] - x[i])/h);
  Line(1+i) = {1+i, 2+i};
  Line(11+i) = {11+i, 12+i};
  Transfinite Curve {1+i, 11+i} = n+1;
  Curve Loop(1+i) = {1+i, 22+i, -(11+i), -(21+i)};
  Plane Surface(1+i) = {1+i};
  Transfinite Surface{1+i};
EndFor
Recombine Surface {:};
Physical Surface("leaf", 1) = {1:4};
Physical Curve("clamp", 11) = {21};
Physical Curve("under", 12) = {2};
Physical Curve("tip_under", 13) = {4};
Physical Curve("tip_top", 14) = {14};
