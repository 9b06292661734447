"""From the message streams of a robot to RGB-D frames with pose."""
