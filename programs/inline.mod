! Shows: inline targets, the form that most generators write. Numbers in every spelling, options, any case.
MODULE Inline
  PERS tooldata tGrind:=[TRUE,[[0,0,150],[1,0,0,0]],[2.5,[0,0,60],[1,0,0,0],0,0,0]];
  PERS wobjdata wPart:=[FALSE,TRUE,"",[[800,-200,300],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];

  PROC main()
    ConfL\Off;
    MoveAbsJ [[0,-30,30,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\NoEOffs,v200,fine,tGrind;
    MoveJ [[0,0,100],[0,0,1,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v200,z10,tGrind\WObj:=wPart;
    MoveL [[.5,0.,- 2.5E1],[0.0000,0.0000,1.0000,0.0000],[0,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,tGrind,\WObj:=wPart;
    MOVEL [[10,0,0],[0,0,1,0],[0,0,0,0],[9e9,9e9,9e9,9e9,9e9,9e9]] , v50\V:=40 , fine\Inpos:=inpos50 , tGrind \WObj := wPart ; ! behind
    MoveL
      [[20,0,0],        ! position
       [0,0,1,0],       ! orientation
       [0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
      v50, z0, tGrind\WObj:=wPart; MoveL [[30,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z0,tGrind\WObj:=wPart;
    !MoveL [[40,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z0,tGrind\WObj:=wPart;
    MoveC [[40,10,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[50,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tGrind\WObj:=wPart;
    ConfL\On;
    MoveL [[50,0,100],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[200,500,5000,1000],[FALSE,10,15,15,1.5,15,1.5],tGrind\WObj:=wPart;
  ENDPROC
ENDMODULE
