"""The scene model drawn with viser."""
