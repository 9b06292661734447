"""HTML of finds, and of the likeliest places after a search without one."""

import base64
from collections.abc import Sequence

from app.messages.status import FindAttribute, FindReport
from app.nodes.console.panels.markup import clock, escape, muted
from app.view.model.candidates import Candidate
from app.view.words import Words


def find_card(find: FindReport, say: Words, *, name: str = "") -> str:
    """Return what was checked of the attributes of a find, below its name where one of several."""
    found = escape(say("panel.find.found"))
    head = f'<p class="ip-state ip-of-tour">{found} <b>{escape(name)}</b></p>' if name else ""
    lines = [f"<li>{escape(_attribute(one, say))}</li>" for one in find.attributes]
    return head + (f"<ul>{''.join(lines)}</ul>" if lines else "")


def counted_head(confirmed: Sequence[str], unlisted: int, say: Words) -> str:
    """Return the heading of what was found so far.

    Args:
        confirmed: Names of the finds that are confirmed.
        unlisted: Number of finds that wait to be judged and are not listed; negative for none.
        say: The words.
    """
    lines = [say("panel.counted.confirmed", names=", ".join(confirmed))] if confirmed else []
    lines += [say("panel.counted.more", n=unlisted)] if unlisted > 0 else []
    title = f'<p class="ip-state ip-of-tour">{escape(say("panel.counted.title"))}</p>'
    return title + "".join(muted(escape(line)) for line in lines)


def counted_find(name: str, position_world: tuple[float, float, float], say: Words) -> str:
    """Return one find of several: its name, and where it is."""
    x, y, z = (say.number(v, 1) for v in position_world)
    where = escape(say("panel.counted.where", x=x, y=y, z=z))
    return muted(f"<b>{escape(name)}</b> {where}")


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
    where = [say("panel.places.where", x=x, y=y, z=z)]
    if picture is not None and place.picture is not None:
        data = base64.b64encode(picture).decode()
        image = f'<img alt="" src="data:image/jpeg;base64,{data}">'
        since_ns = place.picture.picture.stamp_ns - start_ns
        key = "panel.places.before" if since_ns < 0 else "panel.places.seen"
        where.append(say(key, time=clock(since_ns), m=say.number(place.picture.depth_m, 1)))
    likely = escape(say("panel.places.likely", share=say.percent(place.probability)))
    taken_for = say("panel.places.classified", label=say.name(label))
    line = f"{escape(taken_for)}<br>" if label else ""
    return (
        f'<div class="ip-candidate">{image}<p><b>{number}</b> {likely}<br>'
        f"{line}<span>{'<br>'.join(map(escape, where))}</span></p></div>"
    )


def _attribute(one: FindAttribute, say: Words) -> str:
    is_other = one.verdict == "wrong" and bool(one.seen)
    key = f"panel.find.{one.verdict}{'.seen' if is_other else ''}"
    return say(key, value=say.attribute(one.value), by=one.by, seen=say.attribute(one.seen))
