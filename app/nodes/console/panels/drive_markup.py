"""HTML of the Drive tab: what the collision filter did, and what is painted."""

from collections.abc import Sequence

from app.messages.driving import DriveStatus
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


def painted(regions: Sequence[tuple[str, float]], say: Words) -> str:
    """List painted regions, the latest first: what each does, and the area of the map in it."""
    rows = [
        f"<li><b>{escape(say(f'panel.drive.{kind}'))}</b> <span>{escape(covered)}</span></li>"
        for kind, area_m2 in reversed(regions)
        for covered in (
            say("panel.painted.area", n=say.number(area_m2, 1))
            if area_m2 > 0.0
            else say("panel.painted.unmapped"),
        )
    ]
    return f'<ul class="ip-goals">{"".join(rows)}</ul>' if rows else ""
