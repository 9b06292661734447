"""Keeps the whole map in view until the operator moves the camera."""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from ippon.geometry import Float64Array

FOV_RAD: Final = 0.9
_ELEVATION_RAD: Final = math.radians(62.0)
_EASE: Final = 0.16
"""Share of the remaining motion per step."""
_STILL_M: Final = 0.02
_SAME_M: Final = 0.03
_REMEMBERED: Final = 512
_PATIENCE: Final = 40
"""Steps after which a camera command is repeated for a browser that has not followed it: while its
scene loads, a browser drops commands and may reset its camera."""
_MARGIN: Final = 1.12
_WALL_M: Final = 1.2
"""Margin for the walls, which rise above the framed floor."""
_SMALLEST_M: Final = 5.0
_NEAREST_M: Final = 2.5
"""Least distance from which a single thing is shown."""
_CLOSE_UP: Final = 2.2
"""That distance over the size of a large thing."""

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Position and target of a camera, metres in the world."""

    position: tuple[float, float, float]
    look_at: tuple[float, float, float]


def framing(low: Float64Array, high: Float64Array, aspect: float, floor_z_m: float = 0.0) -> View:
    """Return a view of a box from the south and above that shows all of it.

    Args:
        low: (2,) least x and y of the map, metres.
        high: (2,) greatest x and y.
        aspect: Width of the picture over its height.
        floor_z_m: Height of the floor.
    """
    center = 0.5 * (low + high)
    width = max(float(high[0] - low[0]), _SMALLEST_M) * _MARGIN
    depth = max(float(high[1] - low[1]), _SMALLEST_M * 0.75) * _MARGIN + _WALL_M
    half_v = math.tan(0.5 * FOV_RAD)
    # The near edge of the floor is the widest part of the view.
    near = 0.5 * depth * math.cos(_ELEVATION_RAD)
    for_width = 0.5 * width / (half_v * max(aspect, 0.3)) + near
    for_depth = 0.5 * depth * math.sin(_ELEVATION_RAD) / half_v + near
    distance = max(for_width, for_depth)
    back, up = distance * math.cos(_ELEVATION_RAD), distance * math.sin(_ELEVATION_RAD)
    x, y = float(center[0]), float(center[1])
    return View(position=(x, y - back, floor_z_m + up), look_at=(x, y, floor_z_m + 0.4))


START: Final = framing(np.array([-4.0, -3.0]), np.array([4.0, 3.0]), 1.25)
"""Initial view of every camera: the size of a home around the robot."""
_BARE: Final = View(position=(-5.0, 0.0, 0.0), look_at=(0.0, 0.0, 0.0))
"""Camera position of viser's client before the first command."""


@dataclass(slots=True)
class _Watcher:
    client: Any
    sent: deque[View] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    arrived: bool = False
    """The browser has followed a camera command; before, it reports its initial position."""
    seen: View | None = None
    """Last reported view."""
    free: bool = False
    waited: int = 0
    """Steps since the last camera command."""
    now: View | None = None
    flight: View | None = None
    """Where the camera flies to; then it stays there."""


class CameraFollow:
    """Moves the cameras that no operator has moved."""

    def __init__(self) -> None:
        self._watchers: dict[int, _Watcher] = {}
        self._bounds: tuple[Float64Array, Float64Array] | None = None
        self.beside: tuple[Float64Array, Float64Array] | None = None
        """Least and greatest (x, y) of what is beside the map and must be in view."""

    def add(self, client: Any) -> None:
        """Add a browser that has just connected."""
        watcher = _Watcher(client=client)
        self._watchers[client.client_id] = watcher

        @client.camera.on_update
        async def _(camera: Any) -> None:
            self._moved(watcher, camera)

    def remove(self, client: Any) -> None:
        """Remove a browser that has disconnected."""
        self._watchers.pop(client.client_id, None)

    def frame_map(self, client: Any) -> None:
        """Frame the whole map again in one browser."""
        watcher = self._watchers.get(client.client_id)
        if watcher is not None:
            watcher.free, watcher.flight = False, None

    def fly(self, client: Any, centre: Point, size_m: Point, *, at_once: bool = False) -> None:
        """Fly to a thing in one browser, and stay there.

        Args:
            client: The browser.
            centre: Centre of the thing, metres in the world.
            size_m: Edges of the box around it.
            at_once: Without the flight, for people whom motion makes sick.
        """
        watcher = self._watchers.get(client.client_id)
        if watcher is not None:
            now = watcher.seen or watcher.now or START
            watcher.flight = _close_up(now, centre, size_m)
            watcher.now = None if at_once else now

    def step(
        self, bounds: tuple[Float64Array, Float64Array] | None, floor_z_m: float = 0.0
    ) -> None:
        """Move every camera a step towards the view of the whole map.

        Args:
            bounds: Least and greatest (x, y) of the map, metres; None if they are as before.
            floor_z_m: Height of the floor.
        """
        if bounds is not None:
            self._bounds = bounds
        for watcher in tuple(self._watchers.values()):
            if watcher.flight is not None:
                self._move(watcher, watcher.flight)
                if watcher.now is not None and _distance(watcher.now, watcher.flight) < _STILL_M:
                    watcher.free, watcher.flight, watcher.now = True, None, None
        if self._bounds is None:
            return
        low, high = self._bounds
        beside = self.beside
        if beside is not None:
            low, high = np.minimum(low, beside[0]), np.maximum(high, beside[1])
        for watcher in tuple(self._watchers.values()):
            if not watcher.free and watcher.flight is None:
                aspect = watcher.client.camera.aspect
                self._move(watcher, framing(low, high, aspect, floor_z_m))

    def _move(self, watcher: _Watcher, wanted: View) -> None:
        now = watcher.now
        watcher.waited += 1
        if watcher.waited > _PATIENCE and _is_elsewhere(watcher):
            now = None
        if now is None:
            shown = wanted
        elif _distance(now, wanted) < _STILL_M:
            return
        else:
            shown = _between(now, wanted, _EASE)
        watcher.now, watcher.waited = shown, 0
        watcher.sent.append(shown)
        camera = watcher.client.camera
        with watcher.client.atomic():
            camera.position = shown.position
            camera.look_at = shown.look_at

    def _moved(self, watcher: _Watcher, camera: Any) -> None:
        """Stop moving a camera that the operator has moved."""
        seen = watcher.seen = _view_of(camera)
        if any(_distance(seen, sent) <= _SAME_M for sent in reversed(watcher.sent)):
            watcher.arrived = True
        elif watcher.arrived and not any(_distance(seen, v) <= _SAME_M for v in (START, _BARE)):
            watcher.free = True
            watcher.now = watcher.flight = None


def _close_up(now: View, centre: Point, size_m: Point) -> View:
    """Return a view of a thing from above, from the side where the camera is."""
    away = np.array(now.position[:2]) - np.array(centre[:2])
    length = float(np.linalg.norm(away))
    side = away / length if length > _STILL_M else np.array([0.0, -1.0])
    distance = max(_NEAREST_M, _CLOSE_UP * max(size_m))
    x, y, z = centre
    back, up = distance * math.cos(_ELEVATION_RAD), distance * math.sin(_ELEVATION_RAD)
    position = (x + back * float(side[0]), y + back * float(side[1]), z + up)
    return View(position=position, look_at=centre)


def _is_elsewhere(watcher: _Watcher) -> bool:
    if watcher.seen is None or not watcher.sent:
        return True
    return _distance(watcher.seen, watcher.sent[-1]) > _SAME_M


def _between(a: View, b: View, share: float) -> View:
    def mix(p: tuple[float, ...], q: tuple[float, ...]) -> tuple[float, float, float]:
        x, y, z = (u + share * (v - u) for u, v in zip(p, q, strict=True))
        return (x, y, z)

    return View(position=mix(a.position, b.position), look_at=mix(a.look_at, b.look_at))


def _view_of(camera: Any) -> View:
    (x, y, z), (u, v, w) = (tuple(map(float, p)) for p in (camera.position, camera.look_at))
    return View(position=(x, y, z), look_at=(u, v, w))


def _distance(a: View, b: View) -> float:
    ends = zip((*a.position, *a.look_at), (*b.position, *b.look_at), strict=True)
    return max(abs(p - q) for p, q in ends)
