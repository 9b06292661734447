"""Attributes of finds: whether the mug is the red one, by colour and size."""
