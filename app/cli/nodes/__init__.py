"""Commands that start processes: robot, navigator, console, recorder, review."""
