"""Which viewpoint the robot goes to."""
