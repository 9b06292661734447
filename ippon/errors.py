"""Errors that the library raises; everything else it raises is a `ValueError`."""


class IpponError(Exception):
    """Base of every error that a caller may want to catch as one."""


class FrameRejectedError(IpponError):
    """A frame cannot be used: its content contradicts itself or the frames before it."""


class SceneError(IpponError):
    """A scene folder or a home seed does not describe a usable home."""


class MapFileError(IpponError):
    """A saved map is damaged, of another version, or not a map."""
