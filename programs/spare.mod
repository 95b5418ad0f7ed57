! Shows: see calibration.mod; a global name that two modules declare.
MODULE Spare
  CONST robtarget pTwice:=[[500,0,601],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
ENDMODULE
