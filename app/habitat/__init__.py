"""habitat-lab's environment, in a process and a Python of its own."""
