! Shows: named targets, shared by several motions and by two tools, LOCAL, and routine data that hides module data.
MODULE Named
  CONST robtarget p10:=[[600,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p20:=[[650,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]; ! used with two tools
  LOCAL CONST robtarget p30:=[[700,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget home:=[[0,0,0,0,45,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS tooldata tA:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS tooldata tB:=[TRUE,[[0,0,250],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PROC main()
    MoveAbsJ home,vmax,fine,tool0;
    MoveJ p10,v1000,fine,tA;
    MoveL p20,v100,z5,tA;
    MoveL p30,v100,z5,tA;
    MoveL P10,v100,fine,tA;
    MoveL p20,v100,z5,tB;
    hidden;
  ENDPROC
  PROC hidden()
    VAR robtarget p10:=[[1,2,403],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    MoveL p10,v100,fine,tA;
  ENDPROC
ENDMODULE
