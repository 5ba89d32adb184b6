// A block [0, 1] x [0, 1] x [-depth, 0] of n x n cells, one deep; its top meets a wavy surface. gmsh -3 wavy.geo -setnumber n 137 -o out.msh
DefineConstant[ n = {8}, depth = {0.04} ];
Point(1) = {0, 0, -depth}; Point(2) = {1, 0, -depth}; Point(3) = {1, 1, -depth}; Point(4) = {0, 1, -depth};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Transfinite Curve{1:4} = n + 1; Transfinite Surface{1}; Recombine Surface{1};
out[] = Extrude {0, 0, depth} { Surface{1}; Layers{1}; Recombine; };
Physical Volume("block") = {out[1]};
Physical Surface("top") = {out[0]};
Physical Surface("bottom") = {1};
Physical Surface("side_y") = {out[2], out[4]};
Physical Surface("side_x") = {out[3], out[5]};
