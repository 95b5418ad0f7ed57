! Shows: arrays of targets, records with targets, ALIAS, elements by constant and by running index.
MODULE Arrays
  RECORD station
    robtarget place;
    num height;
  ENDRECORD
  ALIAS robtarget corner;
  CONST num count:=3;
  CONST robtarget path{count}:=[
    [[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[510,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[520,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  CONST station first:=[[[600,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],25];
  CONST corner edge:=[[700,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    VAR num i;
    MoveL path{1},v100,z1,tool0;
    MoveL path{count},v100,z1,tool0;
    MoveL path{4},v100,z1,tool0;
    MoveL first.place,v100,z1,tool0;
    MoveL Offs(first.place,0,0,first.height),v100,z1,tool0;
    MoveL edge,v100,fine,tool0;
    FOR i FROM 1 TO count DO
      MoveL path{i},v100,z1,tool0;
    ENDFOR
  ENDPROC
ENDMODULE
