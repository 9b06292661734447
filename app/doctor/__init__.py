"""Checks of this machine: installed packages, libraries, disk space and speed."""
