"""From a path to velocities, and the filter that keeps the robot off obstacles."""
