"""Commands that prepare a machine, a robot and its people."""
