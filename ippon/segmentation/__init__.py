"""Label probabilities per pixel, from open-vocabulary segmentation networks."""
