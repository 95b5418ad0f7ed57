! Shows: instructions that move the robot, or let something move it, without a target in the text; and targets of every form given to
! an instruction that is not known.
MODULE Elsewhere
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget table{2}:=[[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  CONST jointtarget j:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  RECORD part
    robtarget at;
    num n;
  ENDRECORD
  VAR part a;
  PROC main()
    MoveL p,v100,fine,tool0;
    MoveL p,v100,fine,tool0;
    EGMRunPose id,EGM_STOP_HOLD\x;
    MoveL p,v100,fine,tool0;
    StepBwdPath 30,1;
    IndAMove Station_A,2\ToAbsPos:=p.extax.eax_a,20;
    MoveL p,v100,fine,tool0;
    ClearPath;
    MoveL p,v100,fine,tool0;
    CSSAct CSS_X\StiffnessPercentage:=30;
    CSSDeactMoveL p,v10,tool0;
    MoveL p,v100,fine,tool0;
    Glide table{2},v100,tool0;
    Glide a.at,v100,tool0;
    Glide CRobT(),v100,tool0;
    Glide (p),v100,tool0;
    Glide above(3),v100,tool0;
    Glide [p.trans,p.rot,p.robconf,p.extax],v100,tool0;
    Glide j,[[0,0,0,0,a.n,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,tool0;
    Glide p.trans,a.n,[0,0,1,0];
  ENDPROC
  FUNC robtarget above(num h)
    RETURN Offs(p,0,0,h);
  ENDFUNC
ENDMODULE
