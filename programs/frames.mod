! Shows: work objects: user and object frame, moved by a unit, held by the robot with a standing tool, unknown, and changed
! by the program.
MODULE Frames
  PERS wobjdata fixed:=[FALSE,TRUE,"",[[800,0,0],[0.7071068,0,0,0.7071068]],[[10,20,30],[1,0,0,0]]];
  PERS wobjdata turning:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata held:=[TRUE,TRUE,"",[[0,0,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata shifted:=[FALSE,TRUE,"",[[800,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata measured;
  PERS tooldata hand:=[TRUE,[[0,0,120],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS tooldata grinder:=[FALSE,[[900,0,500],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];
  CONST robtarget p:=[[50,0,100],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveL p,v100,fine,hand\WObj:=fixed;
    MoveL p,v100,fine,hand\WObj:=turning;
    MoveL p,v100,fine,grinder\WObj:=held;
    MoveL p,v100,fine,grinder\WObj:=fixed;
    MoveL p,v100,fine,hand\WObj:=elsewhere;
    MoveL p,v100,fine,hand\WObj:=measured;
    MoveL p,v100,fine,nowhere\WObj:=fixed;
    shifted.oframe.trans:=[0,0,5];
    MoveL p,v100,fine,hand\WObj:=shifted;
    shifted.uframe:=DefFrame(p,found2,found3);
    MoveL p,v100,fine,hand\WObj:=shifted;
  ENDPROC
ENDMODULE
