"""Candidates for the object, and the evidence for and against each."""
