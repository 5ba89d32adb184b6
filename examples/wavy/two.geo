// Two blocks [0, 1] x [0, 1], depth high, drawn apart: the lower one of n x n cells, the upper one of m x m, both one deep. Their meshes do not
// match. gmsh -3 two.geo -setnumber n 128 -o out.msh
DefineConstant[ n = {8}, depth = {0.04} ];
m = Ceil(5 * n / 4);
For body In {0:1}
  p = newp; z = -depth + body * (depth + 0.01);
  Point(p) = {0, 0, z}; Point(p + 1) = {1, 0, z}; Point(p + 2) = {1, 1, z}; Point(p + 3) = {0, 1, z};
  l = newl;
  Line(l) = {p, p + 1}; Line(l + 1) = {p + 1, p + 2}; Line(l + 2) = {p + 2, p + 3}; Line(l + 3) = {p + 3, p};
  k = newll; Curve Loop(k) = {l:l + 3};
  s = news; Plane Surface(s) = {k};
  Transfinite Curve{l:l + 3} = (body == 0 ? n : m) + 1; Transfinite Surface{s}; Recombine Surface{s};
  out[] = Extrude {0, 0, depth} { Surface{s}; Layers{1}; Recombine; };
  If (body == 0)
    Physical Volume("lower") = {out[1]}; Physical Surface("bottom") = {s}; Physical Surface("lower_top") = {out[0]};
    Physical Surface("lower_y") = {out[2], out[4]}; Physical Surface("lower_x") = {out[3], out[5]};
  Else
    Physical Volume("upper") = {out[1]}; Physical Surface("upper_bottom") = {s}; Physical Surface("top") = {out[0]};
    Physical Surface("upper_y") = {out[2], out[4]}; Physical Surface("upper_x") = {out[3], out[5]};
  EndIf
EndFor
