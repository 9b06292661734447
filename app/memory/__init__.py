"""What is remembered, on disk and in words."""
