"""The console process: the page, and the scene behind it."""
