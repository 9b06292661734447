"""What the robot remembers: the things in its map, with their places and when they were seen."""
