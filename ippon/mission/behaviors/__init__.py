"""Behaviors: alternatives for what the robot does in a step, in order of priority."""
