// A quarter of a plate [0, w]^2 with a hole of radius r, structured quadrilaterals, in two bodies: the ring around the
// hole (r < radius < ri) and the sheet. gmsh -2 plate.geo -setnumber m 10 -o out.msh
// m: elements per 45 degrees; nr: through the ring; ns: through the sheet
DefineConstant[ m = {10}, nr = {6}, ns = {12}, w = {50}, r = {10}, ri = {20} ];
s = Sqrt(0.5);
Point(1) = {0, 0, 0};
Point(2) = {r, 0, 0};   Point(3) = {s*r, s*r, 0};     Point(4) = {0, r, 0};
Point(5) = {ri, 0, 0};  Point(6) = {s*ri, s*ri, 0};   Point(7) = {0, ri, 0};
Point(8) = {w, 0, 0};   Point(9) = {w, w, 0};         Point(10) = {0, w, 0};
Circle(1) = {2, 1, 3};  Circle(2) = {3, 1, 4};
Circle(3) = {5, 1, 6};  Circle(4) = {6, 1, 7};
Line(5) = {8, 9};       Line(6) = {9, 10};
Line(7) = {2, 5};       Line(8) = {3, 6};             Line(9) = {4, 7};
Line(10) = {5, 8};      Line(11) = {6, 9};            Line(12) = {7, 10};
Transfinite Curve {1, 2, 3, 4, 5, 6} = m+1;
Transfinite Curve {7, 8, 9} = nr+1;
Transfinite Curve {10, 11, 12} = ns+1 Using Progression 1.08;
Curve Loop(1) = {7, 3, -8, -1};     Plane Surface(1) = {1};
Curve Loop(2) = {8, 4, -9, -2};     Plane Surface(2) = {2};
Curve Loop(3) = {10, 5, -11, -3};   Plane Surface(3) = {3};
Curve Loop(4) = {11, 6, -12, -4};   Plane Surface(4) = {4};
Transfinite Surface {1} = {2, 5, 6, 3};
Transfinite Surface {2} = {3, 6, 7, 4};
Transfinite Surface {3} = {5, 8, 9, 6};
Transfinite Surface {4} = {6, 9, 10, 7};
Recombine Surface {:};
Physical Surface("ring", 1) = {1, 2};
Physical Surface("sheet", 2) = {3, 4};
Physical Curve("sym_x0", 11) = {9, 12};
Physical Curve("sym_y0", 12) = {7, 10};
Physical Curve("right", 13) = {5};
Physical Curve("top", 14) = {6};
Physical Curve("hole", 15) = {1, 2};
