! Shows: numbers that no arm can hold. What uses them is left, and says so.
MODULE Immense
  PERS tooldata tFar:=[TRUE,[[0,0,1E20],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS tooldata tHeavy:=[TRUE,[[0,0,100],[1,0,0,0]],[1E12,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata wFar:=[FALSE,TRUE,"",[[0,2E6,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PROC main()
    MoveL [[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tFar;
    MoveL [[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tHeavy;
    MoveL [[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0\WObj:=wFar;
    MoveL [[400,-1E30,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    MoveL [[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[1E39,500,5000,1000],fine,tool0;
    MoveAbsJ [[0,0,0,0,2E7,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
  ENDPROC
ENDMODULE
