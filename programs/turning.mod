! Shows: a routine that calls itself changes nothing in the switches; a parameter by reference may be another name of other data.
MODULE Turning
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num height:=1;
  PROC main()
    tower 3;
    MoveL p,v100,fine,tool0;
    twice height;
  ENDPROC
  PROC tower(num n)
    IF n>0 THEN
      tower n-1;
      MoveL Offs(p,0,0,5),v100,fine,tool0;
    ENDIF
  ENDPROC
  PROC twice(INOUT num h)
    height:=2;
    h:=5;
    MoveL Offs(p,0,0,h),v100,fine,tool0;
    MoveL Offs(p,0,0,height),v100,fine,tool0;
  ENDPROC
ENDMODULE
