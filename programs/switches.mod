! Shows: what acts in execution order across routines: displacement, offsets, configuration monitoring, MultiMove, correction, axes apart.
MODULE Switches
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS pose measured;
  CONST pose shift:=[[0,0,10],[1,0,0,0]];
  PROC main()
    MoveL p,v100,fine,tool0;
    PDispSet shift;
    MoveL p,v100,fine,tool0;
    displaced;
    PDispOff;
    MoveL p,v100,fine,tool0;
    IF flag EOffsSet [1,0,0,0,0,0];
    MoveL p,v100,fine,tool0;
    EOffsOff;
    quiet;
    MoveL p,v100,fine,tool0;
    MoveL p\ID:=10,v100,fine,tool0;
    MoveL p,v100,fine,tool0\Corr;
    SyncMoveOn sync1,tasks;
    MoveL p,v100,fine,tool0;
    SyncMoveOff sync2;
    MoveL p,v100\T:=2,fine,tool0;
    PDispSet measured;
    MoveL p,v100,fine,tool0;
    PDispOn\Rot,p,tool0;
    MoveL p,v100,fine,tool0;
    PDispOff;
    SingArea\LockAxis4;
    MoveL p,v100,fine,tool0;
    SingArea\Off;
    IndCMove ROB_1,6,-90;
    MoveL p,v100,fine,tool0;
    IndReset ROB_1,6;
    MoveL p,v100,fine,tool0; ConfL\On; SingArea\Off;
  ENDPROC
  PROC displaced()
    MoveL p,v100,fine,tool0;
  ENDPROC
  PROC quiet()
    ConfL\Off;
    SingArea\Wrist;
  ENDPROC
ENDMODULE
