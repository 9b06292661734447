"""The simulated camera: rendering and sensor noise."""
