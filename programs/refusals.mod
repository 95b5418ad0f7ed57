! Shows: motions of an IRB 120 that a rewrite leaves, refuses or flags, each with a part of the reason that it must state.
! The tests plan it with a tolerance of 0.005 mm, circles as straight pieces.
MODULE Refusals
  CONST jointtarget home:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ home,v100,fine,tool0; ! expect: joint target
    MoveJ [[380,60,320],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: nothing
    MoveL [[2000,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: out of reach
    MoveL [[380,60,320],[0,0,1,0],[1,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: not reachable in configuration
    MoveJ [[374,0,630],[0.707106781,0,0.707106781,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: another configuration
    MoveJ [[-350,20,400],[0,0,1,0],[1,0,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: joint 1
    MoveJ [[200,-100,400],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: nothing
    MoveL [[200,100,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v2000,fine,tool0; ! expect: joint 1 exceeds its speed limit
    MoveJ [[250,-230,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: nothing
    MoveL [[420,-230,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z200,tool0; ! expect: the path to it deviates
    MoveL [[420,230,320],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: rounded corner
    IF near() MoveL [[420,-230,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: the path to it deviates
    MoveJ [[328.0385,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: nothing
    MoveC [[380,-60,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[431.9615,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100\T:=3,fine,tool0; ! expect: the path to it deviates
    MoveC [[380,-60,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[431.9615,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: full circle
    MoveC [[440,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[450,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect: make no circle
  ENDPROC
  FUNC bool near()
    RETURN di1=1;
  ENDFUNC
ENDMODULE
