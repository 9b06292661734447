"""The bridge to ROS 2: a package that the robot's own Python installs by itself."""
