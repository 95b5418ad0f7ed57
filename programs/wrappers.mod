! Shows: routines of the program that take targets, a parameter as target, and an instruction that nobody declares.
MODULE Wrappers
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    approach p,50\Quick;
    GrindL p,v100,g1,z1,tool0;
    MoveL nowhere,v100,fine,tool0;
    MoveL p,v100;
    MoveL 5,v100,fine,tool0;
  ENDPROC
  PROC approach(robtarget goal, num above \switch Quick)
    MoveJ Offs(goal,0,0,above),v100,z10,tool0;
    MoveL goal,v100,fine,tool0;
  ENDPROC
ENDMODULE
