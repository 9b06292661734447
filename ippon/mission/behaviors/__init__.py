"""What the robot does in one step: the behaviors that the mission chooses from."""
