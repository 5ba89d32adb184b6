// A block [-a, a] x [-h, 0] x [0, w] under a half cylinder of radius r and length l, drawn where it touches the block
// along x = 0: hexahedra. z = 0 is a plane of symmetry of both. gmsh -3 roller3d.geo -setnumber n 56 -setnumber m 40 -o out.msh
// n: elements along the block's top (a multiple of 4); m: along the half cylinder's round (of 4); nw, nl: across both.
DefineConstant[ n = {28}, m = {20}, nw = {8}, nl = {5}, a = {12}, h = {10}, w = {9}, l = {5}, r = {10} ];
// the block, finer towards its top
Point(1) = {-a, 0, 0};   Point(2) = {a, 0, 0};
Point(3) = {a, -h, 0};   Point(4) = {-a, -h, 0};
Line(1) = {1, 2};  Line(2) = {2, 3};  Line(3) = {3, 4};  Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};  Plane Surface(1) = {1};
Transfinite Curve {1, 3} = n+1;
Transfinite Curve {2} = n/4+1 Using Progression 1.15;
Transfinite Curve {4} = n/4+1 Using Progression 1/1.15;
Transfinite Surface {1};
Recombine Surface {1};
block[] = Extrude {0, 0, w} { Surface{1}; Layers{nw}; Recombine; };
// the cylinder's lower part: 80 degrees of it below, cut off by a plane above
s = Sin(2*Pi/9);
c = Cos(2*Pi/9);
Point(111) = {-r*s, r-r*c, 0};  Point(112) = {0, r, 0};  Point(113) = {r*s, r-r*c, 0};  Point(114) = {0, 0, 0};
Circle(111) = {111, 112, 114};  Circle(112) = {114, 112, 113};
Point(115) = {r*s, r/2, 0};  Point(116) = {0, r/2, 0};  Point(117) = {-r*s, r/2, 0};
Line(113) = {113, 115};  Line(114) = {115, 116};  Line(115) = {116, 117};  Line(116) = {117, 111};  Line(117) = {114, 116};
Curve Loop(102) = {111, 117, 115, 116};  Plane Surface(102) = {102};
Curve Loop(103) = {112, 113, 114, -117};  Plane Surface(103) = {103};
Transfinite Curve {111, 112, 114, 115} = m/2+1;
Transfinite Curve {113, 116, 117} = m/4+1;
Transfinite Surface {102} = {111, 114, 116, 117};
Transfinite Surface {103} = {114, 113, 115, 116};
Recombine Surface {102, 103};
cylinder[] = Extrude {0, 0, l} { Surface{102, 103}; Layers{nl}; Recombine; };
// of an extrusion: [0] the end, [1] the volume, then the sides in the order of the loop
Physical Volume("block", 1) = {block[1]};
Physical Volume("cylinder", 2) = {cylinder[1], cylinder[7]};
Physical Surface("block_top", 11) = {block[2]};
Physical Surface("block_base", 12) = {block[4]};
Physical Surface("block_sym", 13) = {1};
Physical Surface("cylinder_round", 14) = {cylinder[2], cylinder[8]};
Physical Surface("cylinder_top", 15) = {cylinder[4], cylinder[10]};
Physical Surface("cylinder_sym", 16) = {102, 103};
