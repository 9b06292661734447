"""The simulated robot base: motion, contact, odometry."""
