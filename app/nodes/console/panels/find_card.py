"""HTML of a find: which one of several it is, and what was checked of its attributes."""

from collections.abc import Sequence

from app.messages.status import FindAttribute, FindReport
from app.nodes.console.panels.markup import escape, muted
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


def _attribute(one: FindAttribute, say: Words) -> str:
    is_other = one.verdict == "wrong" and bool(one.seen)
    key = f"panel.find.{one.verdict}{'.seen' if is_other else ''}"
    return say(key, value=say.attribute(one.value), by=one.by, seen=say.attribute(one.seen))
