"""HTML of the likeliest places after a search without a find."""

import base64

from app.nodes.console.panels.markup import clock, escape
from app.view.model.candidates import Candidate
from app.view.words import Words


def not_found(name: str, count: int | None, say: Words) -> str:
    """Return the heading of the candidate list after a search without a find.

    Args:
        name: What was not found.
        count: Number of places that are listed below; None if they are not known.
        say: The words.
    """
    title = escape(say("panel.places.title", name=name))
    text = escape(say("panel.places.some" if count else "panel.places.none"))
    more = "" if count is None else f"<br>{text}"
    return f'<p class="ip-not-found"><b>{title}</b>{more}</p>'


def candidate(
    number: int,
    place: Candidate,
    picture: bytes | None,
    label: str,
    start_ns: int,
    say: Words,
) -> str:
    """Return one candidate: image, probability, position, and when it was seen."""
    x, y, z = (say.number(v, 1) for v in place.point_world)
    image = f'<span class="ip-no-picture">{escape(say("panel.places.no_image"))}</span>'
    seen = say("panel.places.unseen")
    if picture is not None and place.picture is not None:
        data = base64.b64encode(picture).decode()
        image = f'<img alt="" src="data:image/jpeg;base64,{data}">'
        since_ns = place.picture.picture.stamp_ns - start_ns
        key = "panel.places.before" if since_ns < 0 else "panel.places.seen"
        seen = say(key, time=clock(since_ns), m=say.number(place.picture.depth_m, 1))
    likely = escape(say("panel.places.likely", share=say.percent(place.probability)))
    taken_for = say("panel.places.classified", label=say.name(label))
    line = f"{escape(taken_for)}<br>" if label else ""
    where = escape(say("panel.places.where", x=x, y=y, z=z))
    return (
        f'<div class="ip-candidate">{image}<p><b>{number}</b> {likely}<br>'
        f"{line}<span>{where}<br>{escape(seen)}</span></p></div>"
    )
