"""What is said in an order of its own: "mop first, bucket second", "see the shelf? on it is"."""

import re
from typing import Final

_NEXT: Final = r"(?:second|third|fourth|fifth|next|last)"
_DET: Final = r"(?:the|my|our|that|this)"
_INTO: Final = r"(?:in|into|on|at|under|behind|inside|near|beside)"
_RANKED = re.compile(
    rf",(?: and)? (?!the {_NEXT})([^,.;!?]+?) {_NEXT}(?=\s*(?:[,.;!?]|$))", re.IGNORECASE
)
_RANKING = re.compile(rf",(?: and)? {_NEXT}(?:ly)? (?=(?:the|my|our|a|an|some) )", re.IGNORECASE)
_FIRST = re.compile(r"^first\b|\bfirst,", re.IGNORECASE)
_POINTED_AT = re.compile(
    rf"^(?:(?:do|can) )?(?:you )?see ({_DET}) ([\w ]{{2,30}})[?,]\s*(inside|in|on|under|behind|"
    r"on top|beside|next to)(?: of)?(?: it)?,?(?= (?:there|is|are|you)\b)",
    re.IGNORECASE,
)
"""A place that is pointed at before it is told what is there."""
_PLACE: Final = (
    rf" {_DET} \w+(?: \w+)?,? (?:or,? )?"
    r"(?:(?:no|wait|sorry|i mean|actually|(?:or )?rather|hang on|hold on)\b,? )+"
)
_TAKEN_BACK: Final = rf"{_PLACE}(?:{_INTO} )?(?={_DET} \w+(?: \w+)?"
_CORRECTED = re.compile(
    rf"(?<!\bnot )\b{_INTO}{_PLACE}(?:(?:it|they)(?:['’]s|['’]re| is| are) )?(?={_INTO} {_DET} )",
    re.IGNORECASE,
)
"""A place that is said anew with its preposition: "it's in the van, no, sorry, in the hall"."""
_LEADING_AGAIN = re.compile(
    rf"^({_INTO}){_TAKEN_BACK}, (?:find|get|bring|look|search|where|is|there)\b)", re.IGNORECASE
)
_PLACE_AGAIN = re.compile(
    rf"\b((?:look|check|search)(?:ing)?(?: {_INTO})?){_TAKEN_BACK},? for )",
    re.IGNORECASE,
)
"""A place that is said anew before the object: "look in the bedroom, no, in the bathroom for"."""


def in_order(text: str) -> str:
    """Return a text with what comes first, and the place of what is there, said first."""
    if _FIRST.search(text):
        text = _RANKING.sub(", then ", _RANKED.sub(r", then \1", text))
    text = _CORRECTED.sub("", _POINTED_AT.sub(_pointed_at, text))
    return _LEADING_AGAIN.sub(r"\1 ", _PLACE_AGAIN.sub(r"\1 ", text))


def _pointed_at(match: re.Match[str]) -> str:
    where = {"inside": "in", "on top": "on"}.get(match[3].lower(), match[3])
    return f"{where} {match[1]} {match[2]}"
