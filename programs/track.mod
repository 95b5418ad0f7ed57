! Shows: a robot on a track: the first external axis carries its base, so that the targets of a work object in the world
! cannot be told from the arm alone. 9E9 axes are not connected. The second target lies farther away than any arm reaches.
MODULE Track
  PROC main()
    MoveJ [[400,0,320],[0,0,1,0],[0,0,0,0],[0,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    MoveL [[5400,0,320],[0,0,1,0],[0,0,0,0],[5000,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    MoveL [[5400,60,320],[0,0,1,0],[0,0,0,0],[5000,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
    MoveJ [[400,0,320],[0,0,1,0],[0,0,0,0],[9E9,30,9E9,9E9,9E9,9E9]],v100,fine,tool0;
  ENDPROC
ENDMODULE
