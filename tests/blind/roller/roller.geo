// A block of tyre on a track on a pad, the half x > 0 of each, tetrahedra. All is drawn flat; the scene's maps give the curvature.
// gmsh -3 roller.geo -setnumber h 1.1 -o roller.msh      h: edge under the tyre; on the track 1.3 h
Geometry.AutoCoherence = 0;
DefineConstant[ h = {1.1, Name "Size"} ];
// a box [0, a] x [y0, y1] x [z0, z1] with points o+1 ...; size p below, q above
Macro Brick
  Point(o+1) = {0, y0, z0, p};  Point(o+2) = {a, y0, z0, p};  Point(o+3) = {a, y1, z0, p};  Point(o+4) = {0, y1, z0, p};
  Point(o+5) = {0, y0, z1, q};  Point(o+6) = {a, y0, z1, q};  Point(o+7) = {a, y1, z1, q};  Point(o+8) = {0, y1, z1, q};
  Line(o+1) = {o+1, o+2};  Line(o+2) = {o+2, o+3};  Line(o+3) = {o+3, o+4};  Line(o+4) = {o+4, o+1};
  Line(o+5) = {o+5, o+6};  Line(o+6) = {o+6, o+7};  Line(o+7) = {o+7, o+8};  Line(o+8) = {o+8, o+5};
  Line(o+9) = {o+1, o+5};  Line(o+10) = {o+2, o+6};  Line(o+11) = {o+3, o+7};  Line(o+12) = {o+4, o+8};
  Curve Loop(o+1) = {o+1, o+2, o+3, o+4};           Plane Surface(o+1) = {o+1};  // below
  Curve Loop(o+2) = {o+5, o+6, o+7, o+8};           Plane Surface(o+2) = {o+2};  // above
  Curve Loop(o+3) = {o+1, o+10, -(o+5), -(o+9)};    Plane Surface(o+3) = {o+3};  // y0
  Curve Loop(o+4) = {o+2, o+11, -(o+6), -(o+10)};   Plane Surface(o+4) = {o+4};  // x = a
  Curve Loop(o+5) = {o+3, o+12, -(o+7), -(o+11)};   Plane Surface(o+5) = {o+5};  // y1
  Curve Loop(o+6) = {o+4, o+9, -(o+8), -(o+12)};    Plane Surface(o+6) = {o+6};  // x = 0
  Surface Loop(o+1) = {o+1:o+6};  Volume(o+1) = {o+1};
Return
o = 0;    a = 8;   y0 = -5;  y1 = 5;   z0 = 0;   z1 = 8;   p = h;      q = 2.2*h;  Call Brick;  // tyre
o = 100;  a = 10;  y0 = -8;  y1 = 11;  z0 = -5;  z1 = 0;   p = 2.4*h;  q = 1.3*h;  Call Brick;  // track
// the pad hangs on the track's lower face
o = 200;
Point(201) = {0, y0, -9, 2.4*h};  Point(202) = {a, y0, -9, 2.4*h};  Point(203) = {a, y1, -9, 2.4*h};  Point(204) = {0, y1, -9, 2.4*h};
Line(201) = {201, 202};  Line(202) = {202, 203};  Line(203) = {203, 204};  Line(204) = {204, 201};
Line(209) = {201, 101};  Line(210) = {202, 102};  Line(211) = {203, 103};  Line(212) = {204, 104};
Curve Loop(201) = {201, 202, 203, 204};       Plane Surface(201) = {201};
Curve Loop(203) = {201, 210, -101, -209};     Plane Surface(203) = {203};
Curve Loop(204) = {202, 211, -102, -210};     Plane Surface(204) = {204};
Curve Loop(205) = {203, 212, -103, -211};     Plane Surface(205) = {205};
Curve Loop(206) = {204, 209, -104, -212};     Plane Surface(206) = {206};
Surface Loop(201) = {201, 101, 203, 204, 205, 206};  Volume(201) = {201};
Physical Volume("tyre", 1) = {1};
Physical Volume("track", 2) = {101, 201};
Physical Surface("tread", 11) = {1};
Physical Surface("hub", 12) = {2};
Physical Surface("track_top", 13) = {102};
Physical Surface("pad_base", 14) = {201};
Physical Surface("sym_x0", 15) = {6, 106, 206};
