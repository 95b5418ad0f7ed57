0 BEGIN PGM MODES MM
; Shows: Heidenhain: cycles that turn, scale, mirror and tilt, and what ends each; tools by name, longer tools, limits of the handwheel.
; truegrind angles wpr
; truegrind tool T1 tGrind [[0,0,150],[1,0,0,0]]
; truegrind tool FINE tFine [[0,0,120],[1,0,0,0]]
; truegrind frame G54 preset [[500,0,200],[1,0,0,0]]
1 TOOL CALL 1 Z S1000
2 M128
3 L X+0 Y+0 Z+50 A+180 B+0 C+0 R0 F3000
4 CYCL DEF 8.0 MIRROR IMAGE
5 CYCL DEF 8.1 X
6 PLANE RESET STAY
7 L X+1 Y+2 Z+50 A+180 B+0 C+0
8 CYCL DEF 8.0 MIRROR IMAGE
9 CYCL DEF 8.1
10 CYCL DEF 19.0 WORKING PLANE
11 CYCL DEF 19.1 A+0 B+0 C+0
12 L X+1 Y+2 Z+50 A+180 B+0 C+0
13 M118 X1 Y1
14 L Y+3
15 TOOL CALL "FINE" Z S2000
16 L X+1 Y+2 Z+50 A+180 B+0 C+0
17 TOOL CALL 1 Z S1000 DL+5
18 L X+1 Y+2 Z+50
19 TOOL CALL 1 Z S1000
20 QL1 = 7
21 Q1 = 20
22 L X+Q1 Y+2 Z+50
23 L X+5 M99
24 L Y+5
25 END PGM MODES MM
