! Shows: values that a target must not have, and values that the text does not tell.
MODULE Doubtful
  PERS robtarget later;
  CONST robtarget zero:=[[500,0,300],[0,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget loose:=[[0,0,9E9,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST num notTarget:=3;
  VAR num table{2}:=[1,2];
  PROC main()
    MoveL later,v100,fine,tool0;
    MoveL zero,v100,fine,tool0;
    MoveAbsJ loose,v100,fine,tool0;
    MoveL notTarget,v100,fine,tool0;
    MoveL *,v100,fine,tool0;
    MoveL <EXP>,v100,fine,tool0;
    MoveL CRobT(),v100,fine,tool0;
    MoveL Offs(zero2,0,0,ReadNum(dev)),v100,fine,tool0;
    MoveL Offs(CRobT(\Tool:=tool0\WObj:=wobj0),0,0,20),v100,fine,tool0;
    <SMT>
  ENDPROC
ENDMODULE
