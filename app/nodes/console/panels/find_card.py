"""HTML of a find: its object in a tour, and what was checked of its attributes."""

from app.messages.status import FindAttribute, FindReport
from app.nodes.console.panels.markup import escape, words
from app.view.words import Words


def find_card(find: FindReport, say: Words, *, in_tour: bool) -> str:
    """Return the object of a find, in a tour of several, and what was checked of its attributes."""
    found = say("panel.find.found")
    name = f'<p class="ip-state ip-of-tour">{found} <b>{words(find.object)}</b></p>'
    lines = [f"<li>{escape(_attribute(one, say))}</li>" for one in find.attributes]
    return (name if in_tour else "") + (f"<ul>{''.join(lines)}</ul>" if lines else "")


def _attribute(one: FindAttribute, say: Words) -> str:
    is_other = one.verdict == "wrong" and bool(one.seen)
    key = f"panel.find.{one.verdict}{'.seen' if is_other else ''}"
    return say(key, value=one.value, by=one.by, seen=one.seen)
