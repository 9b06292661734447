"""From the streams of a robot to frames."""
