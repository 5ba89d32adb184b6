// Two plates of thickness h that overlap by 2 a, quadrilaterals; no point is shared by both. A bolt clamps them over |x| < b.
// gmsh -2 lapjoint.geo -setnumber n 96 -o out.msh
// n: elements along the overlap on the lower plate (a multiple of 8); the upper one has 5/4 as many, so that the nodes do not match.
DefineConstant[ n = {48}, h = {4}, a = {20}, b = {8}, length = {40} ];
For p In {0:1}                  // the lower plate, then the upper one, mirrored at the origin
  s = p == 0 ? 1 : -1;
  m = p == 0 ? n : 5*n/4;       // along the overlap: 1/5 of it beyond the washer on either side is 3/10 of the elements
  o = 20*p;
  x[] = {-a-length, -a, -b, b, a};
  For k In {0:4}
    Point(o+k+1) = {s*x[k], 0, 0};
    Point(o+k+6) = {s*x[k], -s*h, 0};
    Line(o+k+1) = {o+k+1, o+k+6};
  EndFor
  For k In {0:3}
    Line(o+k+6) = {o+k+1, o+k+2};
    Line(o+k+11) = {o+k+6, o+k+7};
    Curve Loop(o+k+1) = {o+k+6, o+k+2, -(o+k+11), -(o+k+1)};
    Plane Surface(o+k+1) = {o+k+1};
  EndFor
  Transfinite Curve {o+1:o+5} = n/8+1;
  Transfinite Curve {o+6, o+11} = n/4+1;
  Transfinite Curve {o+7, o+9, o+12, o+14} = Floor(m*0.3+0.5)+1;
  Transfinite Curve {o+8, o+13} = Floor(m*0.4+0.5)+1;
  Transfinite Surface {o+1:o+4};
EndFor
Recombine Surface {1:4, 21:24};
Physical Surface("lower", 1) = {1:4};
Physical Surface("upper", 2) = {21:24};
Physical Curve("lower_face", 11) = {7:9};
Physical Curve("upper_face", 12) = {27:29};
Physical Curve("lower_washer", 13) = {13};
Physical Curve("upper_washer", 14) = {33};
Physical Curve("clamped", 15) = {1};
Physical Curve("pulled", 16) = {21};
