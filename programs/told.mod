! Shows: values that the text tells through functions of the program, Dim, counting instructions and PDispOn between two programmed points.
MODULE Told
  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget q:=[[510,20,330],[0,0,0.8,0.6],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST num table{3}:=[1,2,3];
  VAR num n;
  PROC main()
    MoveL above(5),v100,fine,tool0;
    MoveL above(5\more:=above(2)),v100,fine,tool0;
    MoveL Offs(p,0,0,Dim(table,1)),v100,fine,tool0;
    n:=3;
    Incr n;
    Add n,2;
    MoveL Offs(p,0,0,n),v100,fine,tool0;
    PDispOn\ExeP:=q,p,tool0;
    MoveL p,v100,fine,tool0;
    PDispOn\Rot\ExeP:=q,p,tool0;
    MoveL p,v100,fine,tool0;
    PDispOff;
    MoveL measured(5),v100,fine,tool0;
  ENDPROC
  FUNC robtarget above(num h\robtarget more)
    RETURN Offs(p,0,0,h);
  ENDFUNC
  FUNC robtarget measured(num h)
    n:=h;
    RETURN Offs(p,0,0,h);
  ENDFUNC
ENDMODULE
