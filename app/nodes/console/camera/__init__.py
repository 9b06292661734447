"""The live camera on the pages."""
