! Shows: tools and work objects of which statements assign components, or which routines are given, and what then holds.
MODULE Components
  CONST robtarget p:=[[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pGiven:=[[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pRaised:=[[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pRetried:=[[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS tooldata tool1:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS tooldata tool2:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS tooldata tool3:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS tooldata tool4:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata w:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wBelt:=[FALSE,FALSE,"CNV1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wGiven:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR num nFound;
  VAR intnum iStop;
  PROC main()
    ! Nothing has said where w stands.
    MoveL p,v100,fine,tool2\WObj:=w;
    w.uframe.trans:=[10,20,30];
    w.uframe.rot:=OrientZYX(90,0,0);
    ! oframe, which nothing assigns, is still what the declaration says.
    MoveL p,v100,fine,tool2\WObj:=w;
    MoveL p,v100,fine,tool1\WObj:=w;
    tool1.tframe.trans.z:=150;
    MoveL p,v100,fine,tool1\WObj:=w;
    IF nFound>0 THEN
      w.uframe.trans.x:=nFound;
    ENDIF
    MoveL p,v100,fine,tool1\WObj:=w;
    w.uframe:=[[0,0,0],[1,0,0,0]];
    MoveL p,v100,fine,tool1\WObj:=w;
    unchanging;
    MoveL p,v100,fine,tool1\WObj:=w;
    shifting;
    MoveL p,v100,fine,tool1\WObj:=w;
    nFound:=shiftingToo();
    MoveL p,v100,fine,tool1\WObj:=w;
    ! Read, not changed: by instructions of the controller and by a routine of the program.
    WaitWObj wBelt\RelDist:=100;
    MoveL p,v100,fine,tool2\WObj:=wBelt;
    EGMActPose egm1\Tool:=tool2\WObj:=wobj0,corr,EGM_FRAME_WOBJ,sense,EGM_FRAME_WOBJ\x:=lim\y:=lim;
    wrapped p,tool2\WObj:=wobj0; wrapped p,tool1\WObj:=wobj0;
    MoveL p,v100,fine,tool2;
    ! Nobody knows what these do with what they are given.
    elsewhere pGiven;
    MoveL pGiven,v100,fine,tool2;
    elsewhere2 wGiven;
    MoveL p,v100,fine,tool2\WObj:=wGiven;
    IF CurrentPos(p,tool4) MoveL p,v100,fine,tool4;
    MToolTCPCalib j1,j2,j3,j4,tool3,nFound,nFound;
    MoveL p,v100,fine,tool3;
    ! A trap routine may raise it between any two statements.
    CONNECT iStop WITH raising;
    pRaised.trans.z:=300;
    MoveL pRaised,v100,fine,tool2;
    ! And the error handler before the motion is tried again.
    pRetried.trans.z:=300;
    MoveL pRetried,v100,fine,tool2;
  ERROR
    pRetried.trans.z:=pRetried.trans.z+10;
    RETRY;
  ENDPROC
  PROC wrapped(robtarget goal,PERS tooldata tool\PERS wobjdata WObj)
    MoveL [[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool;
    MoveL [[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool2\WObj?WObj;
  ENDPROC
  PROC unchanging()
    nFound:=3;
    TPWrite "x";
  ENDPROC
  PROC shifting()
    w.uframe.trans.y:=nFound;
  ENDPROC
  FUNC num shiftingToo()
    shifting;
    RETURN 1;
  ENDFUNC
  TRAP raising
    pRaised.trans.z:=pRaised.trans.z+100;
    RETURN;
  ENDTRAP
ENDMODULE
