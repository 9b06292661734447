"""What the navigator keeps: goals, the lease of control, the saved map."""
