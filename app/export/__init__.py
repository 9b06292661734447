"""Exports of a recording: files for other programs, videos, report."""
