! Shows: reasons that depend on the bounds that are stated and on what the model knows. Behind each motion: scene and
! part of the reason. Scenes: bound = largest correction 0.0001 mm; turn = largest turn 1e-7 rad; singular = smallest
! distance to singularity 1; unsure = a model that was certain to 1e-12 mm where it was measured; elsewhere = measured at
! 150° in every joint; narrow = joint 2 measured up to 5°; loose = circles as straight pieces within 0.5 mm; joints =
! joint targets are rewritten; branch = any correction is allowed, for one of several arms.
MODULE Bounds
  PROC main()
    MoveJ [[380,60,320],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect bound: exceeds the bound (--max-correction) | turn: ° exceeds the bound | singular: too close to a singularity | unsure: the model is uncertain here | elsewhere: no measured pose is near | narrow: outside the range in which the arm was measured
    MoveL [[390,70,320],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect bound: exceeds the bound (--max-correction) | turn: ° exceeds the bound | singular: too close to a singularity | unsure: the model is uncertain here | elsewhere: no measured pose is near | narrow: outside the range in which the arm was measured
    MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect bound: joint target | joints: nothing
    MoveJ [[328.0385,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect loose: nothing
    MoveC [[380,-60,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[431.9615,-30,320],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100\T:=3,fine,tool0; ! expect loose: the circle was kept
    MoveJ [[374,0,630.432000],[0.709224916,0,0.704982282,0],[0,0,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    MoveJ [[374,0,630.216000],[0.708166645,0,0.706045326,0],[0,0,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect branch: another configuration
    MoveJ [[374,0,629.784000],[0.706045326,0,0.708166645,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0; ! expect branch: another configuration
    MoveJ [[374,0,629.568000],[0.704982282,0,0.709224916,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
  ENDPROC
ENDMODULE
