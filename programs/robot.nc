; Shows: what A, B and C mean is said nowhere.
; truegrind tool T0 tGrind [[0,0,150],[1,0,0,0]]
; truegrind frame G54 wPart [[500,0,200],[1,0,0,0]]
G21 G90
G1 X10 Y0 Z5 A0 B0 C180 F100
