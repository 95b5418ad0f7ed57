! Shows: motion instructions of every kind with the options that they take, in any case and spacing.
MODULE Instructions
  PERS tooldata t:=[TRUE,[[0,0,120],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS loaddata load:=[2,[0,0,50],[1,0,0,0],0,0,0];
  CONST robtarget a:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget b:=[[600,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget c:=[[550,50,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget j:=[[0,0,0,0,45,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR robtarget found;
  VAR triggdata gun;
  VAR triggios gunon{1};
  PROC main()
    MoveL\Conc,a,v100\V:=80,z5\Z:=4\Inpos:=inpos20,t\WObj:=wobj0\TLoad:=load;
    movel ToPoint:=b, Speed:=v100, Zone:=z5, Tool:=t;
    MoveC\Conc,c,b,v100\T:=3,z5,t\NoCorr;
    MoveAbsJ\Conc,j\NoEOffs,v100,fine,t;
    MoveJAO a,v100,z5,t,ao1,5;
    MoveLGO b,v100,z5,t\WObj:=wobj0,go1\Value:=5;
    MoveCDO c,b,v100,z5,t,do1,1;
    MoveCAO c,b,v100,z5,t,ao1,2;
    MoveCGO c,b,v100,z5,t,go1\Value:=1;
    MoveCSync c,b,v100,z5,t,"Count";
    MoveAbsJDO j,v100,z5,t,do1,1;
    TriggJ a,v100,gun\T2:=gun\T3:=gun,z5\Inpos:=inpos50,t;
    TriggC c,b,v100,gun,z5,t;
    TriggAbsJ j,v100,gun,z5,t;
    TriggLIOs\Conc,a,v100\TriggData1:=gunon,z5,t;
    TriggJIOs b,v100\TriggData1:=gunon,z5,t;
    SearchC\SStop,di1\Flanks,found,c,b,v100,t;
    SearchL\Sup,di1,found,b,v100\V:=50,t\WObj:=wobj0;
    ArcL1Start a,v100,seam1,weld1,fine,t;
    ArcL1 b,v100,seam1,weld1\Weave:=weave1,z1,t;
    ArcC1 c,b,v100,seam1,weld1,z1,t;
    ArcL1End a,v100,seam1,weld1,fine,t;
    ArcAdaptL b,v100,adapt1,seam1,weld1,z1,t;
    FCPressC c,b,v20,20,z1,t;
    CapL b,v100,cap1,weavestart1,weave1,z1,t;
    CapC c,b,v100,cap1,weavestart1,weave1,z1,t;
    SpotJ a,v500,gun1,spot1\InPos,t;
    SpotML a,v500\G1:=spot1,t;
    NutL a,v100,gun1,t;
    PaintC c,b,v500,z10,t;
    DispC\Off,c,b,v100,bead1,z1,t;
    LaserLStart a,v100,laser1,fine,t;
    LaserL b,v100,laser1,z1,t;
    SMoveJ a,v100,z5,t;
    CalibL a,v100,gun1\TipChg,t;
    MeasureWearL a,v100,gun1,t;
    MoveL <ARG>,v100\<ARG>,z5,t;
  ENDPROC
ENDMODULE
