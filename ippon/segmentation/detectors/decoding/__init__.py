"""What the outputs of each family of detectors say."""
