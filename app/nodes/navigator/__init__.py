"""The navigator: the mission as a process on the network."""
