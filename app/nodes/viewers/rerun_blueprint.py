"""The arrangement of Rerun's views: two maps, images, plots, status and log."""

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
    words = rrb.Horizontal(
        rrb.TextDocumentView(origin=STATUS, name="Status"),
        rrb.TextLogView(origin=LOG, name="Log"),
    )
    side = rrb.Vertical(images, plots, words, row_shares=[2, 1, 1])
    return rrb.Blueprint(
        rrb.Horizontal(maps, side, column_shares=[3, 2]),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
        rrb.SelectionPanel(state="collapsed"),
    )


_NAMES = ("Probability", "Proximity", "Camera colours")


def _scene(shown: str, name: str) -> rrb.Spatial3DView:
    """Return a view of the world with one of the maps, and without the image in its frustum."""
    hidden = [f"- /{entity}/**" for entity in CLOUDS if entity != shown]
    contents = ["+ /world/**", *hidden, f"- /{DEPTH}"]
    return rrb.Spatial3DView(origin="/world", contents=contents, name=name)
