"""The arrangement of Rerun's views: maps, images, plots, status and log."""

from typing import Final

import rerun.blueprint as rrb

from app.nodes.viewers.rerun_scene import (
    CAMERA,
    CLOUDS,
    COLOR,
    DEPTH,
    FIGURES,
    LOG,
    STATUS,
    TIMELINE,
)


def blueprint() -> rrb.Blueprint:
    """Return the blueprint that a viewer gets with the data."""
    maps = rrb.Tabs(
        *(_scene(entity, name) for entity, name in zip(CLOUDS, _NAMES, strict=True)),
        active_tab=0,
    )
    images = rrb.Horizontal(
        rrb.Spatial2DView(origin=CAMERA, contents=[f"+ /{COLOR}"], name="Camera"),
        rrb.Spatial2DView(origin=CAMERA, contents=[f"+ /{DEPTH}"], name="Depth"),
    )
    best, *others = FIGURES
    plots = rrb.Horizontal(
        rrb.TimeSeriesView(origin=best, name="Best match"),
        rrb.TimeSeriesView(origin="/", contents=[f"+ /{entity}" for entity in others], name="Path"),
    )
    status = rrb.TextDocumentView(origin=STATUS, name="Status")
    log = rrb.TextLogView(origin=LOG, name="Log")
    side = rrb.Vertical(images, plots, status, log, row_shares=[4, 3, 2, 3])
    return rrb.Blueprint(
        rrb.Horizontal(maps, side, column_shares=[3, 2]),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        rrb.SelectionPanel(state="collapsed"),
    )


_NAMES: Final = ("Probability", "Proximity", "Camera colours")
_EYE_M: Final = (-4.0, -4.0, 12.0)
_TARGET_M: Final = (3.0, 3.0, 0.0)
"""Where a view looks from and to at first: down, at the place where the robot's frame begins."""


def _scene(shown: str, name: str) -> rrb.Spatial3DView:
    """Return a view of the world with one of the maps, and without the image in its frustum."""
    hidden = [f"- /{entity}/**" for entity in CLOUDS if entity != shown]
    contents = ["+ /world/**", *hidden, f"- /{DEPTH}"]
    return rrb.Spatial3DView(
        origin="/world",
        contents=contents,
        name=name,
        eye_controls=rrb.EyeControls3D(position=_EYE_M, look_target=_TARGET_M, eye_up=(0, 0, 1)),
    )
