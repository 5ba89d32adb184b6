// A block [-a, a] x [-h, 0] under a half cylinder of radius r, drawn where it touches the block at x = 0: quadrilaterals.
// gmsh -2 roller.geo -setnumber n 96 -setnumber m 72 -o out.msh
// n: elements along the block's top; m: elements along the half cylinder's round (even). No point is shared by both bodies.
DefineConstant[ n = {64}, m = {48}, a = {16}, h = {12}, r = {10} ];
// the block, finer towards its top
Point(1) = {-a, 0, 0};   Point(2) = {a, 0, 0};
Point(3) = {a, -h, 0};   Point(4) = {-a, -h, 0};
Line(1) = {1, 2};  Line(2) = {2, 3};  Line(3) = {3, 4};  Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};  Plane Surface(1) = {1};
Transfinite Curve {1, 3} = n+1;
Transfinite Curve {2} = n/4+1 Using Progression 1.08;
Transfinite Curve {4} = n/4+1 Using Progression 1/1.08;
Transfinite Surface {1};
// the cylinder's lower half: a sector of 120 degrees below, cut off at half of the radius
s = Sin(Pi/3);
Point(11) = {-r*s, r/2, 0};  Point(12) = {0, r, 0};  Point(13) = {r*s, r/2, 0};  Point(14) = {0, 0, 0};
Circle(11) = {11, 12, 14};  Circle(12) = {14, 12, 13};
Point(15) = {r*s, r, 0};  Point(16) = {0, r, 0};  Point(17) = {-r*s, r, 0};
Line(13) = {13, 15};  Line(14) = {15, 16};  Line(15) = {16, 17};  Line(16) = {17, 11};  Line(17) = {14, 16};
Curve Loop(2) = {11, 17, 15, 16};  Plane Surface(2) = {2};
Curve Loop(3) = {12, 13, 14, -17};  Plane Surface(3) = {3};
Transfinite Curve {11, 12, 14, 15} = m/2+1;
Transfinite Curve {13} = m/4+1;
Transfinite Curve {16} = m/4+1;
Transfinite Curve {17} = m/4+1;
Transfinite Surface {2} = {11, 14, 16, 17};
Transfinite Surface {3} = {14, 13, 15, 16};
Recombine Surface {1, 2, 3};
Physical Surface("block", 1) = {1};
Physical Surface("cylinder", 2) = {2, 3};
Physical Curve("block_top", 11) = {1};
Physical Curve("block_base", 12) = {3};
Physical Curve("cylinder_round", 13) = {11, 12};
Physical Curve("cylinder_top", 14) = {14, 15};
