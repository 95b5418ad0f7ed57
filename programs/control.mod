! Shows: every statement around motions: compact IF, loops, TEST, GOTO and labels, handlers, traps, functions, late binding,
! strings that look like code.
MODULE Control(NOSTEPIN)
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR intnum alarm;
  PROC main()
    VAR num i:=0;
    CONNECT alarm WITH onAlarm;
    TPWrite "MoveL p,v100,fine,tool0; ! ""no"" \5C move";
    again:
    IF i<3 MoveL p,v100,fine,tool0;
    IF i=0 THEN
      MoveJ p,v100,z10,tool0;
    ELSEIF NOT (i>1 AND TRUE) OR i=9 THEN
      MoveJ Offs(p,0,0,10),v100,z10,tool0;
    ELSE
      Stop;
    ENDIF
    WHILE i<5 DO
      MoveL p,v100,z1,tool0;
      i:=i+1;
    ENDWHILE
    FOR k FROM 10 TO 1 STEP -1 DO
      TEST k MOD 3
      CASE 0,1:
        MoveL p,v100,z1,tool0;
      DEFAULT:
        GOTO again;
      ENDTEST
    ENDFOR
    %"path"+NumToStr(i,0)%;
    %"go"% p,v100;
    RETURN;
  BACKWARD
    MoveL p,v100,fine,tool0;
  ERROR (ERR_PATH_STOP)
    MoveL p,v10,fine,tool0;
    RETRY;
  UNDO
    Reset do1;
  ENDPROC
  FUNC bool near(robtarget a, num limit \switch strict)
    RETURN Distance(a.trans,p.trans)<limit;
  ENDFUNC
  TRAP onAlarm
    MoveL p,v10,fine,tool0;
  ENDTRAP
ENDMODULE
