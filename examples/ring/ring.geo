// A quarter of a ring [a, b] around a solid core of radius a, quadrilaterals. The two contact circles coincide, with matching or
// non-matching meshes. gmsh -2 ring.geo -setnumber n 4 -setnumber m 7 -o out.msh
// n: elements through the ring; m: elements of the core's circle per 45 degrees (0: as for the ring). The bodies share no points and
// Coherence is not used, so that gmsh does not merge the circles.
Geometry.AutoCoherence = 0;
DefineConstant[ n = {4}, m = {0}, a = {4.1}, b = {4.7} ];
s = Sqrt(0.5);
k = 2*n;
c = m > 0 ? m : k;
// the ring, in two halves
Point(1) = {0, 0, 0};
Point(2) = {a, 0, 0};  Point(3) = {a*s, a*s, 0};  Point(4) = {0, a, 0};
Point(5) = {b, 0, 0};  Point(6) = {b*s, b*s, 0};  Point(7) = {0, b, 0};
Circle(1) = {2, 1, 3};  Circle(2) = {3, 1, 4};  Circle(3) = {5, 1, 6};  Circle(4) = {6, 1, 7};
Line(5) = {2, 5};  Line(6) = {3, 6};  Line(7) = {4, 7};
Curve Loop(1) = {5, 3, -6, -1};  Plane Surface(1) = {1};
Curve Loop(2) = {6, 4, -7, -2};  Plane Surface(2) = {2};
Transfinite Curve {1, 2, 3, 4} = k+1;
Transfinite Curve {5, 6, 7} = n+1;
// the core: a square, and two blocks around it
q = 0.5*a;
Point(11) = {0, 0, 0};  Point(12) = {q, 0, 0};  Point(13) = {0.85*q, 0.85*q, 0};  Point(14) = {0, q, 0};
Point(15) = {a, 0, 0};  Point(16) = {a*s, a*s, 0};  Point(17) = {0, a, 0};
Line(11) = {11, 12};  Line(12) = {12, 13};  Line(13) = {13, 14};  Line(14) = {14, 11};
Line(15) = {12, 15};  Line(16) = {13, 16};  Line(17) = {14, 17};
Circle(18) = {15, 11, 16};  Circle(19) = {16, 11, 17};
Curve Loop(11) = {11, 12, 13, 14};  Plane Surface(11) = {11};
Curve Loop(12) = {15, 18, -16, -12};  Plane Surface(12) = {12};
Curve Loop(13) = {16, 19, -17, -13};  Plane Surface(13) = {13};
Transfinite Curve {11, 12, 13, 14, 18, 19} = c+1;
Transfinite Curve {15, 16, 17} = c+1;
Transfinite Surface {1, 2, 11, 12, 13};
Recombine Surface {1, 2, 11, 12, 13};
Physical Surface("ring", 1) = {1, 2};
Physical Surface("core", 2) = {11, 12, 13};
Physical Curve("ring_inside", 11) = {1, 2};
Physical Curve("ring_outside", 12) = {3, 4};
Physical Curve("core_outside", 13) = {18, 19};
Physical Curve("sym_y0", 14) = {5, 11, 15};
Physical Curve("sym_x0", 15) = {7, 14, 17};
