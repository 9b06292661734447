"""The console on a recording, and the list of recordings."""
