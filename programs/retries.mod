! Shows: an error handler that goes back with StartMoveRetry: what it changes, and what the routines called may have left set.
MODULE Retries
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST pose shift:=[[0,0,10],[1,0,0,0]];
  PROC main()
    VAR robtarget q;
    VAR robtarget r;
    q:=p;
    r:=p;
    MoveL q,v100,fine,tool0;
    MoveL r,v100,fine,tool0;
    between;
    MoveL r,v100,fine,tool0;
  ERROR
    q.trans.z:=310;
    StartMoveRetry;
  ENDPROC
  PROC between()
    PDispSet shift;
    MoveL p,v100,fine,tool0;
    PDispOff;
  ENDPROC
ENDMODULE
