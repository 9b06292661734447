"""Common sense: which common objects the goal is found near."""
