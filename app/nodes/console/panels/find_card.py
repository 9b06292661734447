"""HTML of a find: its object in a tour, and what was checked of its attributes."""

from app.messages.status import FindAttribute, FindReport
from app.nodes.console.panels.markup import escape, words


def find_card(find: FindReport, *, in_tour: bool) -> str:
    """Return the object of a find, in a tour of several, and what was checked of its attributes."""
    name = f'<p class="ip-state ip-of-tour">Found: <b>{words(find.object)}</b></p>'
    lines = [f"<li>{_attribute(one)}</li>" for one in find.attributes]
    return (name if in_tour else "") + (f"<ul>{''.join(lines)}</ul>" if lines else "")


def _attribute(one: FindAttribute) -> str:
    value, by = escape(one.value), escape(one.by)
    if one.verdict == "unchecked":
        return f"{value}: not checked"
    seen = f", it is {escape(one.seen)}" if one.seen and one.verdict == "wrong" else ""
    return f"{value}: {'yes' if one.verdict == 'right' else 'no'}{seen} ({by})"
