"""Commands that start nodes: robot, navigator, console, recorder, review."""
