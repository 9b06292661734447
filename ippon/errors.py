"""Errors of the library; invalid arguments raise `ValueError` instead."""


class IpponError(Exception):
    """Base class of the library's errors."""


class FrameRejectedError(IpponError):
    """A frame cannot be used: its content contradicts itself or the frames before it."""


class SceneError(IpponError):
    """A scene folder or a home seed does not describe a usable home."""


class MapFileError(IpponError):
    """A saved map is damaged, of another version, or not a map."""
