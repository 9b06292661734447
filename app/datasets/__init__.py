"""RGB-D datasets and bags as the messages of a robot."""
