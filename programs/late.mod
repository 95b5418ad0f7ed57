! Shows: routines called by computed names, ExitCycle, and what they may find set: a displacement that one way brings about.
MODULE Late
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST pose shift:=[[0,0,10],[1,0,0,0]];
  VAR num n:=1;
  PROC main()
    MoveL p,v100,fine,tool0;
    path1;
    PDispSet shift;
    %"path"+ValToStr(n)%;
    CallByVar "job",n;
    IF di1=1 ExitCycle;
    PDispOff;
    MoveL p,v100,fine,tool0;
    %"ends"%;
    MoveL p,v100,fine,tool0;
    apart;
  ENDPROC
  PROC path1()
    MoveL p,v100,fine,tool0;
  ENDPROC
  PROC job2()
    MoveL p,v100,fine,tool0;
  ENDPROC
  PROC apart()
    MoveL p,v100,fine,tool0;
  ENDPROC
  PROC ends()
    ConfL\Off;
  ENDPROC
ENDMODULE
