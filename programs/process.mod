! Shows: instructions with other arguments: signals, triggers, searches, arc welding, force control, paint, spot, dispense.
MODULE Process
  PERS tooldata t:=[TRUE,[[0,0,120],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  VAR robtarget found;
  CONST robtarget a:=[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget b:=[[600,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget c:=[[550,50,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR triggdata gun;
  PROC main()
    MoveLDO a,v100,z5,t,do1,1;
    MoveJSync b,v100,z5,t,"Count";
    TriggL a,v100,gun\T2:=gun,z5,t;
    SearchL\Stop,di1\PosFlank,found,b,v100,t;
    MoveL found,v100,fine,t;
    ArcLStart a,v100,seam1,weld1\Weave:=weave1,fine,t;
    ArcC c,b,v100,seam1,weld1,z1,t;
    ArcLEnd a,v100,seam1,weld1,fine,t;
    FCPress1LStart a,v20\Fz:=20,50\ForceChange:=50\PosSupvDist:=[50,50,50],z1,t;
    FCPressL b,v20,20,z1,t;
    FCPressEnd a,v20\DeactOnly,t;
    PaintL b,v500,z10,t;
    SpotL a,v500,gun1,spot1,t;
    DispL\On,b,v100,bead1,z1,t;
    MoveExtJ [[9E9,9E9,9E9,9E9,9E9,9E9],[100,9E9,9E9,9E9,9E9,9E9]],v100,fine;
    EGMMoveL egmId,a,v100,fine,t;
  ENDPROC
ENDMODULE
