"""Runs evaluations: workers, the folder of results, plots and the report."""
