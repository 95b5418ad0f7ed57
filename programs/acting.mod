! Shows: targets whose expressions do more than answer. A literal in their place would lose what else they do.
MODULE Acting
  CONST robtarget p:=[[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num layers:=0;
  PROC main()
    MoveJ at(p,nextLayer()),v100,fine,tool0;
    MoveL at(p,2),v100,fine,tool0;
  ENDPROC
  FUNC robtarget at(robtarget there,num layer)
    RETURN there;
  ENDFUNC
  FUNC num nextLayer()
    layers:=layers+1;
    RETURN 1;
  ENDFUNC
ENDMODULE
