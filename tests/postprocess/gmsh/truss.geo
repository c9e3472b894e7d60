h = 1.5; L = 2.0; n = 4;
For i In {0:n}
  Point(1+i) = {i*L, 0, 0};
EndFor
For i In {0:n-1}
  Point(101+i) = {(i+0.5)*L, h, 0};
EndFor
For i In {0:n-1}
  Line(1+i) = {1+i, 2+i};
  Line(201+2*i) = {1+i, 101+i};
  Line(202+2*i) = {101+i, 2+i};
EndFor
For i In {0:n-2}
  Line(101+i) = {101+i, 102+i};
EndFor
Transfinite Curve {1:n, 101:100+n-1, 201:200+2*n} = 2;
Physical Curve("chords") = {1:n, 101:100+n-1};
Physical Curve("diagonals") = {201:200+2*n};
Physical Point("supports") = {1, 1+n};
Physical Point("load") = {3};
