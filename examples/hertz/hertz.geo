// Two quarter-disks of radius r (above) and s (below) that touch at the origin, right half of a pair of half-disks, triangles. The
// meshes of the contact lines do not match. gmsh -2 hertz.geo -setnumber n 40 -setnumber m 31 -o out.msh
// n, m: elements of the contact line of the upper and of the lower disk; c: length of these lines. The disks share no points and
// Coherence is not used, so that gmsh does not merge the two.
Geometry.AutoCoherence = 0;
Mesh.MeshSizeExtendFromBoundary = 1;
DefineConstant[ n = {40}, m = {31}, r = {10}, s = {10}, c = {1} ];
upper = c/n;
lower = c/m;
coarse = r/8;
// the upper disk, its centre at (0, r)
Point(1) = {0, r, 0, coarse};    Point(2) = {0, 0, 0, upper};
Point(3) = {c, r - Sqrt(r*r - c*c), 0, upper};  Point(4) = {r, r, 0, coarse};
Line(1) = {1, 2};  Circle(2) = {2, 1, 3};  Circle(3) = {3, 1, 4};  Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};  Plane Surface(1) = {1};
// the lower disk, its centre at (0, -s)
Point(11) = {0, -s, 0, coarse};  Point(12) = {0, 0, 0, lower};
Point(13) = {c, Sqrt(s*s - c*c) - s, 0, lower};  Point(14) = {s, -s, 0, coarse};
Line(11) = {12, 11};  Line(12) = {11, 14};  Circle(13) = {14, 11, 13};  Circle(14) = {13, 11, 12};
Curve Loop(2) = {11, 12, 13, 14};  Plane Surface(2) = {2};
Transfinite Curve {2} = n+1;
Transfinite Curve {14} = m+1;
Physical Surface("upper", 1) = {1};
Physical Surface("lower", 2) = {2};
Physical Curve("upper_sym", 11) = {1};
Physical Curve("upper_top", 12) = {4};
Physical Curve("upper_contact", 13) = {2};
Physical Curve("lower_sym", 14) = {11};
Physical Curve("lower_base", 15) = {12};
Physical Curve("lower_contact", 16) = {14};
