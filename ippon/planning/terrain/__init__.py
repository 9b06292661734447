"""Where the body can stand and drive."""
