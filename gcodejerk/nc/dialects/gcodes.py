"""G codes by name, times ten, so that whole numbers compare exactly: ``G90`` is 900, ``G61_1`` 611.

Names and nothing else: what a code does in a language, its table says. The second reader may import
this module for that reason.
"""

G0, G1, G4 = 0, 10, 40
G17, G18, G19 = 170, 180, 190
G20, G21 = 200, 210
G28 = 280
G40 = 400
G43, G43_1, G49 = 430, 431, 490
G54_1 = 541
G61, G61_1, G64 = 610, 611, 640
G80 = 800
G90, G90_1, G91, G91_1 = 900, 901, 910, 911
G94, G95 = 940, 950
G98, G99 = 980, 990
