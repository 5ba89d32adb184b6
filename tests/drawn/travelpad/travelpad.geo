// A cantilever [0,100] x [0,20] (x, z), top at y = 0, thickness 8; a pad 20 x 14 x 8 above it, drawn with its middle at x = 0.
// The pad is off the cantilever's middle plane (z from 4 to 18). mm. gmsh -3 travelpad.geo
DefineConstant[ nx = {80}, nz = {12}, ny = {4}, px = {30}, pz = {22}, py = {6} ];
L = 100; w = 20; h = 8; a = 10; b = 8;
Point(1) = {0,-h,0}; Point(2) = {L,-h,0}; Point(3) = {L,0,0}; Point(4) = {0,0,0};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Curve Loop(1) = {1,2,3,4}; Plane Surface(1) = {1};
Transfinite Curve {1,3} = nx+1; Transfinite Curve {2,4} = ny+1;
Transfinite Surface {1}; Recombine Surface {1};
beam[] = Extrude {0,0,w} { Surface{1}; Layers{nz}; Recombine; };
Point(101) = {-a,0,4}; Point(102) = {a,0,4}; Point(103) = {a,b,4}; Point(104) = {-a,b,4};
Line(101) = {101,102}; Line(102) = {102,103}; Line(103) = {103,104}; Line(104) = {104,101};
Curve Loop(101) = {101,102,103,104}; Plane Surface(101) = {101};
Transfinite Curve {101,103} = px+1; Transfinite Curve {102,104} = py+1;
Transfinite Surface {101}; Recombine Surface {101};
pad[] = Extrude {0,0,14} { Surface{101}; Layers{pz}; Recombine; };
Physical Volume("beam") = {beam[1]};
Physical Volume("pad") = {pad[1]};
Physical Surface("beam_top") = {beam[4]};
Physical Surface("beam_clamp") = {beam[5]};
Physical Surface("beam_tip") = {beam[3]};
Physical Surface("pad_under") = {pad[2]};
Physical Surface("pad_top") = {pad[4]};
