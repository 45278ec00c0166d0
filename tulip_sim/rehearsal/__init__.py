"""What a motion would do to the robot, played in the simulator before it goes to hardware: docs/rehearse.md."""
