// A strap clamp, half of it (z >= 0): strap over a heel block and a workpiece. mm. Heel and nose are drawn flat and rounded by the scene.
L = 60; t = 8; w = 8; nz = 3;
Macro Box4
  // x0, x1, y0, y1, nx, ny, base id b
  Point(b+1) = {x0, y0, 0}; Point(b+2) = {x1, y0, 0}; Point(b+3) = {x1, y1, 0}; Point(b+4) = {x0, y1, 0};
  Line(b+1) = {b+1, b+2}; Line(b+2) = {b+2, b+3}; Line(b+3) = {b+3, b+4}; Line(b+4) = {b+4, b+1};
  Curve Loop(b+1) = {b+1:b+4}; Plane Surface(b+1) = {b+1};
  Transfinite Curve {b+1, b+3} = nx + 1; Transfinite Curve {b+2, b+4} = ny + 1;
  Transfinite Surface {b+1}; Recombine Surface {b+1};
Return
// strap in three pieces along x so that the bolt area is a group
Point(1) = {0, 0, 0}; Point(2) = {24, 0, 0}; Point(3) = {36, 0, 0}; Point(4) = {60, 0, 0};
Point(5) = {60, t, 0}; Point(6) = {36, t, 0}; Point(7) = {24, t, 0}; Point(8) = {0, t, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 1}; Line(9) = {2, 7}; Line(10) = {3, 6};
Curve Loop(1) = {1, 9, 7, 8}; Plane Surface(1) = {1};
Curve Loop(2) = {2, 10, 6, -9}; Plane Surface(2) = {2};
Curve Loop(3) = {3, 4, 5, -10}; Plane Surface(3) = {3};
Transfinite Curve {1, 7, 3, 5} = 13; Transfinite Curve {2, 6} = 7; Transfinite Curve {4, 8, 9, 10} = 4;
Transfinite Surface {1, 2, 3}; Recombine Surface {1, 2, 3};
b = 100; x0 = 4; x1 = 14; y0 = -8; y1 = 0; nx = 8; ny = 4; Call Box4;
b = 200; x0 = 46; x1 = 56; y0 = -8; y1 = 0; nx = 8; ny = 4; Call Box4;
s[] = Extrude {0, 0, w} { Surface{1}; Layers{nz}; Recombine; };
m[] = Extrude {0, 0, w} { Surface{2}; Layers{nz}; Recombine; };
e[] = Extrude {0, 0, w} { Surface{3}; Layers{nz}; Recombine; };
h[] = Extrude {0, 0, w} { Surface{101}; Layers{nz}; Recombine; };
k[] = Extrude {0, 0, w} { Surface{201}; Layers{nz}; Recombine; };
Physical Volume("strap") = {s[1], m[1], e[1]};
Physical Volume("heel") = {h[1]}; Physical Volume("nose") = {k[1]};
Physical Surface("strap_under") = {s[2], m[2], e[2]};
Physical Surface("strap_end") = {s[5]};
Physical Surface("bolt") = {m[4]};
Physical Surface("sym") = {1, 2, 3, 101, 201};
Physical Surface("heel_top") = {h[4]}; Physical Surface("heel_base") = {h[2]};
Physical Surface("nose_top") = {k[4]}; Physical Surface("nose_base") = {k[2]};
