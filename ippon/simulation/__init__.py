"""Simulated homes, cameras, robots and segmentation; the entry is `world.SimulatedWorld`."""
