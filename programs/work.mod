! Shows: see calibration.mod.
MODULE Work
  PROC main()
    MoveJ pSafe,v500,z50,tSpindle;
    MoveL [[0,0,10],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tSpindle\WObj:=wTable;
    MoveL pPrivate,v50,fine,tSpindle\WObj:=wTable;
    MoveL pTwice,v50,fine,tSpindle;
  ENDPROC
ENDMODULE
