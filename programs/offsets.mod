! Shows: Offs, RelTool and MirPos of named and inline targets, with constants, arithmetic and with what only a loop knows.
MODULE Offsets
  CONST num pitch:=12.5;
  CONST num double:=2*pitch;
  CONST robtarget base:=[[500,0,300],[0,0.7071068,0.7071068,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS wobjdata mirror:=[FALSE,TRUE,"",[[0,0,0],[0.7071068,0.7071068,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata table:=[FALSE,TRUE,"",[[100,50,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PROC main()
    VAR num i;
    MoveL Offs(base,0,0,50),v100,fine,tool0;
    MoveL Offs(base,double+1,-pitch,0),v100,z1,tool0;
    MoveL RelTool(base,0,0,-20),v100,z1,tool0;
    MoveL RelTool(base,1,2,3\Rx:=90\Rz:=90),v100,z1,tool0;
    MoveL Offs(RelTool(base,0,0,-20),5,0,0),v100,z1,tool0;
    MoveL Offs([[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],10,20,30),v100,z1,tool0;
    MoveL MirPos(base,mirror),v100,z1,tool0;
    MoveL MirPos(base,mirror\WObj:=table\MirY),v100,z1,tool0\WObj:=table;
    MoveL ORobT(base),v100,z1,tool0;
    FOR i FROM 1 TO 5 DO
      MoveL Offs(base,i*pitch,0,0),v100,z1,tool0;
    ENDFOR
  ENDPROC
ENDMODULE
