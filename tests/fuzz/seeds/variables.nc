G21 G90
#1=5
#<depth>=[#1*2]
G0 X#1 Y[#<depth>+1]
G0 Z[sin[30]]
O100 if [#1 gt 3]
G0 X7
O100 endif
O101 while [#1 lt 9]
#1=[#1+1]
G1 X#1 F10
O101 endwhile
G0 X1
G0 X2
M2
