// A block [0, a] x [0, h] on a foundation [0, b] x [-d, 0], right half of both, triangles. The two contact lines coincide, with
// matching or non-matching meshes. gmsh -2 blocks.geo -setnumber n 24 -setnumber m 17 -o out.msh
// n, m: elements of the contact line of the block and of the foundation (0: n). The bodies share no points and Coherence is not used, so
// that gmsh does not merge the two lines.
Geometry.AutoCoherence = 0;
DefineConstant[ n = {24}, m = {0}, a = {20}, h = {16}, b = {40}, d = {24} ];
fine = a/n;
coarse = 5*fine;
// the block
Point(1) = {0, 0, 0, fine};    Point(2) = {a, 0, 0, fine};
Point(3) = {a, h, 0, coarse};  Point(4) = {0, h, 0, coarse};
Line(1) = {1, 2};  Line(2) = {2, 3};  Line(3) = {3, 4};  Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};  Plane Surface(1) = {1};
// the foundation
Point(11) = {0, 0, 0, fine};     Point(12) = {a, 0, 0, fine};    Point(13) = {b, 0, 0, coarse};
Point(14) = {b, -d, 0, coarse};  Point(15) = {0, -d, 0, coarse};
Line(11) = {11, 12};  Line(12) = {12, 13};  Line(13) = {13, 14};  Line(14) = {14, 15};  Line(15) = {15, 11};
Curve Loop(2) = {11, 12, 13, 14, 15};  Plane Surface(2) = {2};
Transfinite Curve {1} = n+1;
Transfinite Curve {11} = (m > 0 ? m : n)+1;
Physical Surface("block", 1) = {1};
Physical Surface("foundation", 2) = {2};
Physical Curve("block_sym", 11) = {4};
Physical Curve("block_top", 12) = {3};
Physical Curve("block_under", 13) = {1};
Physical Curve("foundation_sym", 14) = {15};
Physical Curve("foundation_base", 15) = {14};
Physical Curve("foundation_top", 16) = {11};
