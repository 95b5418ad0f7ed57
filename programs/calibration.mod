! Shows (with work.mod and spare.mod, listed in task.pgf): tools, work objects and targets declared in another module of the task.
MODULE Calibration(SYSMODULE)
  PERS tooldata tSpindle:=[TRUE,[[0,0,180],[0.9238795,0,0.3826834,0]],[4,[0,0,90],[1,0,0,0],0,0,0]];
  TASK PERS wobjdata wTable:=[FALSE,TRUE,"",[[700,0,200],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST robtarget pSafe:=[[500,0,600],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pTwice:=[[500,0,602],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL CONST robtarget pPrivate:=[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
ENDMODULE
