"""HTML of the Drive tab: what the collision filter did, and what is painted."""

from collections.abc import Sequence

from app.messages.driving import DriveStatus, PaintedStroke
from app.nodes.console.panels.markup import answer, escape
from app.view.words import Words


def intervention(drive: DriveStatus, say: Words) -> str:
    """Return the safety filter's intervention, or the waypoint that the robot drives to."""
    if drive.intervention:
        return f'<p class="ip-answer ip-bad">{escape(drive.intervention)}</p>'
    if drive.waypoint is not None:
        x, y = (say.number(v, 1) for v in drive.waypoint)
        return answer(say("panel.drive.waypoint", x=x, y=y), ok=True)
    return ""


def painted(regions: Sequence[tuple[PaintedStroke, float]], say: Words) -> str:
    """List painted regions, the latest first: what each does, its area of the map and its room."""
    rows: list[str] = []
    for one, area_m2 in reversed(regions):
        mapped = say("panel.painted.area", n=say.number(area_m2, 1))
        covered = mapped if area_m2 > 0.0 else say("panel.painted.unmapped")
        where = " · ".join(filter(None, [covered, say.room(one.room)]))
        rows.append(
            f"<li><b>{escape(say(f'panel.drive.{one.kind}'))}</b> <span>{escape(where)}</span></li>"
        )
    return f'<ul class="ip-goals">{"".join(rows)}</ul>' if rows else ""
