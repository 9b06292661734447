"""Commands that prepare a robot and its people: certificates."""
