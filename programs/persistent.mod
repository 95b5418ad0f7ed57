! Shows: persistent data, which stay on the controller: offsets by them remain in the program, what else they compute is left.
MODULE Persistent
  PERS num stock:=5;
  LOCAL PERS num wear{2}:=[0.2,0.3];
  PERS num part:=2;
  PERS num pass:=2;
  CONST num lift:=50;
  CONST robtarget pEdge:=[[500,0,300],[0,0.7071068,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pParts{2}:=[[[480,40,300],[0,0.7071068,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[480,80,300],[0,0.7071068,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  PERS robtarget pGiven:=[[480,60,300],[0,0.7071068,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pSeen:=[[480,20,300],[0,0.7071068,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    VAR robtarget pNow;
    MoveJ Offs(pEdge,0,0,lift),v100,fine,tool0;
    MoveL Offs(pEdge,0,0,stock),v100,fine,tool0;
    MoveL Offs(pEdge,40,0,stock+wear{1}),v100,fine,tool0;
    MoveL RelTool(pEdge,0,40,-stock\Rz:=wear{2}),v100,fine,tool0;
    MoveL Offs(pEdge,0,0,lift),v100,fine,tool0;
    MoveL pParts{part},v100,fine,tool0;
    pNow:=pEdge;
    pNow.trans.z:=300+stock;
    MoveL pNow,v100,fine,tool0;
    MoveL pGiven,v100,fine,tool0;
    MoveL Offs(pSeen,0,0,5),v100,fine,tool0;
    pass:=1;
    MoveL Offs(pEdge,0,20,pass),v100,fine,tool0;
  ENDPROC
ENDMODULE
