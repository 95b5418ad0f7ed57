! Shows: circular motions of every kind, one after a comment between its points, one with named arguments; each keeps its
! circle, or becomes straight pieces of the same process when asked.
MODULE Circles
  CONST robtarget p1:=[[328.0385,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[380,-60,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p3:=[[431.9615,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ p1,v100,fine,tool0;
    MoveC p2,p3,v100,z1,tool0;
    MOVEC p2 , ! the way back
      p1,v100,z1,tool0 \WObj:=wobj0;
    MoveC CirPoint:=p2,ToPoint:=p3,v100,z1,tool0;
    MoveCDO p2,p1,v100,z1,tool0,do1,1;
    MoveCSync p2,p3,v100,z1,tool0,"count";
    TriggC p2,p1,v100,gun,z1,tool0;
    ArcCStart p2,p3,v100,seam1,weld1,z1,tool0;
    ArcC p2,p1,v100,seam1,weld1\Weave:=weave1,z1,tool0;
    ArcCEnd p2,p3,v100,seam1,weld1,fine,tool0;
    FCPressC p2,p1,v20,20,z1,tool0;
    DispC p2,p3,v100,bead1,z1,tool0;
    PaintC p2,p1,v100,z1,tool0;
    CirPathMode\CirPointOri;
    MoveC p2,p3,v100,fine,tool0; CirPathMode\PathFrame;
  ENDPROC
ENDMODULE
