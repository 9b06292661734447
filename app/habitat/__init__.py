"""habitat-lab's environment, in a separate process with its own Python."""
