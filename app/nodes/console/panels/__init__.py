"""The tabs beside the scene."""
