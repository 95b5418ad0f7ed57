%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%

MODULE Old ! Shows: an old .prg file: header, several modules in one file, CRLF, tabs, Latin-1 names and GBK bytes in a comment.
	CONST robtarget pZurück:=[[600,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
	! ´òÄ¥Î»ÖÃ
	PROC main()
		MoveL pZURÜCK,v100,fine,tool0;
		MoveL pOther,v100,fine,tool0;
	ENDPROC
ENDMODULE
MODULE Second
	CONST robtarget pOther:=[[610,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
	LOCAL CONST robtarget pZurück:=[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
	PROC two()
		MoveL pZurück,v100,fine,tool0;
	ENDPROC
ENDMODULE