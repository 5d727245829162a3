"""What an arm is: segments, joints, paths of muscles, posture from markers."""
