(Shows: arcs by centre and radius, modal, rising, whole, in increments; each stays an arc or becomes straight blocks)
(truegrind angles wpr)
(truegrind tool T0 bare [[0,0,0],[1,0,0,0]])
(truegrind frame G54 base [[0,0,0],[1,0,0,0]])
G90 G17 G21 G54
G1 X440 Y0 Z320 A180 B0 C180 F3000
N20 G03 X320 Y0 I-60 J0
N30 X440 I60
G2 X380 Y-60 Z332 R-60
G3 J60
G91 G2X60Y60I60J0
G90 G1 X400
M2
