"""Recordings read: messages of any moment, repair of files that were cut off."""
