"""The simulated segmentation and its errors."""
