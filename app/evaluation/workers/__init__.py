"""Running of episodes in processes of this machine or of a Ray cluster."""
