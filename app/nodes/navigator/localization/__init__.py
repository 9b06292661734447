"""Where the robot is: in a kept map, and with a camera that knows no pose."""
