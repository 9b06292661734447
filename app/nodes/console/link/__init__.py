"""The line between the console and the navigator."""
