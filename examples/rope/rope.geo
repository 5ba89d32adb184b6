// The rope of section 6: [0, 1] in n nodes, evenly spaced.
DefineConstant[ n = {100, Name "Nodes"} ];
Point(1) = {0, 0, 0};
Point(2) = {1, 0, 0};
Line(1) = {1, 2};
Transfinite Curve {1} = n;
Physical Curve("rope", 1) = {1};
Physical Point("ends", 2) = {1, 2};
