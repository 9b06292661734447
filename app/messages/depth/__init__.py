"""Depth images as ROS 2 messages, raw and compressed."""
