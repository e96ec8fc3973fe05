%
O1 (sub) sub
G0 X1
O1 endsub
N10 G20 G91
N20 G0X1.Y-.5(comment)
n30g1z-0.1f10
/G0 X1
N40 G0 Z.1 ; end
M30
%
