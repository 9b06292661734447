"""The navigator: a thin shell round one mission."""
