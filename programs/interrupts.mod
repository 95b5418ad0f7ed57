! Shows: what may happen between any two statements: a trap routine that displaces, data that a sensor writes.
MODULE Interrupts
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST pose shift:=[[0,0,10],[1,0,0,0]];
  VAR intnum alarm;
  VAR num found:=0;
  PROC main()
    CONNECT alarm WITH onAlarm;
    ISignalDI di1,1,alarm;
    IVarValue "sen1:",8,found,alarm;
    MoveL p,v100,fine,tool0;
    MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
  ENDPROC
  PROC other()
    MoveAbsJ CalcJointT(Offs(p,found,0,0),tool0),v100,fine,tool0;
    MoveL Offs(p,found,0,0),v100,fine,tool0;
  ENDPROC
  TRAP onAlarm
    PDispSet shift;
    MoveL p,v10,fine,tool0;
  ENDTRAP
ENDMODULE
