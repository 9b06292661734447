"""Recordings written: the session, its MCAP file and its limits."""
