! Shows: real syntax errors. Each is one region that is listed and never edited; everything around it is read.
MODULE Broken
  PROC main()
    MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    MoveL [[500,0,300],[0,0,1,0,[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    TPWrite "not closed;
    MoveL [[510,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0
    MoveL [[520,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    ENDIF
    x := ;
    MoveL [[530,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
  ENDPROC
ENDMODULE
and what somebody wrote below
