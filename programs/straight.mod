! Shows: one variable that straight-line assignments fill before each motion, as some polishing generators write.
MODULE Straight
  VAR robtarget pCurrent;
  CONST num WorkZ:=350;
  PERS tooldata tPolish:=[TRUE,[[0,0,200],[1,0,0,0]],[3,[0,0,80],[1,0,0,0],0,0,0]];
  PROC main()
    pCurrent.rot:=[0,0,1,0];
    pCurrent.robconf:=[0,0,0,0];
    pCurrent.extax:=[9E9,9E9,9E9,9E9,9E9,9E9];
    pCurrent.trans:=[400,100,WorkZ];
    MoveL pCurrent,v100,fine,tPolish;
    pCurrent.trans.x:=pCurrent.trans.x+25;
    MoveL pCurrent,v100,z1,tPolish;
    IF DInput(di1)=1 THEN
      pCurrent.trans.y:=-100;
    ENDIF
    MoveL pCurrent,v100,z1,tPolish;
    pCurrent:=[[450,0,WorkZ+10],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    MoveL pCurrent,v100,fine,tPolish;
    pCurrent:=CRobT(\Tool:=tPolish);
    MoveL pCurrent,v100,fine,tPolish;
  ENDPROC
ENDMODULE
