G21 G90 G64 (msg, hi)
(debug, #1)
G0 X 1 0 . 5 Y+.5
  g 0 z - 3
G0 A90
G0 A-90 X1
G0 U1 W2
;last
G0 X1 X2
G0 X1..2
G0 (open
G0 X0 (a (b) c)
M2
