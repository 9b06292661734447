"""A drawing under one node, so that all of it can be moved aside, or hidden."""

from typing import Any, Final

ONCE: Final = frozenset({"add_light_ambient", "add_light_directional", "add_grid"})
"""What lights the whole scene, and its floor: the first drawing has put them there for all."""


class _Beneath:
    """viser's scene, with every node under another."""

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
    """What `ViserScene` needs of a server or a client, for a drawing beside another.

    Args:
        server: The server or the client.
        root: Name of the node, with a slash before it.
    """

    def __init__(self, server: Any, root: str) -> None:
        self.scene = _Beneath(server.scene, root)
        self.atomic = server.atomic
