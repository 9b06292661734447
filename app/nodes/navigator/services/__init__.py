"""The requests that the navigator serves."""
