"""A drawing under one scene node, so that it can be moved or hidden as a whole."""

from typing import Any, Final

ONCE: Final = frozenset({"add_light_ambient", "add_light_directional", "add_grid"})
"""Lights and floor of the scene, which the first drawing adds for all."""


class _Beneath:
    """viser's scene API with every node below a root node."""

    def __init__(self, scene: Any, root: str) -> None:
        self._scene = scene
        self._root = root

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._scene, name)
        if name in ONCE:
            return lambda *_, **__: None
        if not name.startswith("add_"):
            return method

        def add(node: str, *arguments: Any, **named: Any) -> Any:
            return method(f"{self._root}{node}", *arguments, **named)

        return add


class Subtree:
    """The part of a server or client that `ViserScene` needs, for a second drawing.

    Args:
        server: The server or the client.
        root: Name of the root node, with a leading slash.
    """

    def __init__(self, server: Any, root: str) -> None:
        self.scene = _Beneath(server.scene, root)
        self.atomic = server.atomic
