; Shows: a plain three-axis program, as thousands are: nothing turns the tool, nothing says where part and tool are.
G21 G90
X0
G1 X1
G0 X0 Y0 Z5
G1 Z-1 F100
G1X10Y10
M30
