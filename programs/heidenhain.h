0 BEGIN PGM SHOWS MM
; Shows: Heidenhain conversational: L, LN, C about CC, CR, increments, Q parameters, TCPM, calls, cycles.
; truegrind angles wpr
; truegrind tool T1 tGrind [[0,0,150],[1,0,0,0]]
; truegrind frame G54 preset [[500,0,200],[1,0,0,0]]
1 BLK FORM 0.1 Z X+0 Y+0 Z-40
2 TOOL CALL 1 Z S1000
3 * - Roughing
4 L X+0 Y+0 Z+50 A+180 B+0 C+0 R0 FMAX M3
5 M128
6 Q1 = +5
7 FN 0: Q2 = -2,5
8 L X+0 Y+0 Z+50 A+180 B+0 C+0 R0 FMAX
9 L Z+Q1 F600
10 L IX+10 Y-1,5
11 L X+Q2 RL
12 L X+12 R0
13 CC X+20 Y-1,5
14 C X+20 Y+6,5 DR+
15 CR X+30 Y+16,5 R+10 DR-
16 LN X+31 Y+16 Z+5 TX+0 TY+0 TZ+1
17 CT X+35 Y+10
18 L X+35 Y+10 Z+5
19 CALL LBL 1
20 L X+1 Y+1 Z+1 A+180 B+0 C+0
21 L Z+0 M91
22 CYCL CALL
23 PLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY
24 L X+1 Y+1 Z+1
25 M129
26 END PGM SHOWS MM
