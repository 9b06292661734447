"""What segmentations and detectors send: heatmaps, boxes, masks, and their names."""
