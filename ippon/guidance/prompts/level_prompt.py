"""Prompt for proximity levels.

The semantics are those of the paper's prompt (Sec. Semantic Guidance, Listing 1); the wording is
ours. Only known labels, levels and bounded reasons are taken from an answer.
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast

from ippon.guidance.language.words import plain
from ippon.guidance.levels import LabelLevel, Level
from ippon.guidance.prompts.reply import answer_of
from ippon.vocabulary import canonical_label

ReplyFormat = Literal["lines", "json"]

MAX_REASON_CHARS = 200
MAX_REPLY_CHARS = 200_000
_MAX_UNKNOWN = 20

_DEFINITIONS = """\
Judge by horizontal distance alone: I can look up and down. Use these levels:
- FAR: the {ooi} is probably in another room. A bed, for instance, is far from a sink.
- AVERAGE: nothing points either way. This is the default. It is also the level of what is found \
everywhere, such as walls, floors, ceilings and doors, and of broad categories that include the \
{ooi} among many other things.
- NEAR: the {ooi} is typically close to it. A TV, for instance, is near a bed or a sofa.
- CERTAIN: the {ooi} is surely in its vicinity, or the category is the {ooi} itself; one instance \
of the category with a {ooi} beside it is enough.
The question has a direction. Whoever stands at a chair is certain to find a floor; whoever stands \
on a floor has, on average, no chair beside them."""

_LINES = """\
Give a short reason first and the level after it. Answer in plain text with one line for each \
category, in this form and nothing else:
category: reason. LEVEL
Write the categories exactly as they are in the list; a program reads your answer."""

_JSON = """\
Give a short reason first and the level after it. Answer with one JSON object and nothing else. \
Its keys are the categories exactly as they are in the list, its values objects with the keys \
"reason" and "level", in this order; "level" is one of FAR, AVERAGE, NEAR, CERTAIN."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParsedReply:
    """Content of an answer."""

    rows: tuple[LabelLevel, ...]
    """In the order of the vocabulary; labels without an answer are left out."""
    missing: tuple[str, ...]
    """Labels without an answer, in the order of the vocabulary."""
    unknown: tuple[str, ...]
    """Rated categories that were not requested."""


def build_prompt(
    ooi: str,
    context: str,
    scenario: str,
    vocabulary: Sequence[str],
    *,
    reply: ReplyFormat = "lines",
) -> str:
    """Return the prompt for the levels of a goal.

    Args:
        ooi: The goal in words: "red hat".
        context: The operator's words; empty leaves the sentence out.
        scenario: "an apartment with different rooms"; empty leaves it out.
        vocabulary: Labels of the common objects.
        reply: Form of the answer.
    """
    name = _quoted(ooi, 80)
    said = _quoted(context, 2000)
    where = _quoted(scenario, 200)
    about = f' The owner told me: "{said}".' if said else ""
    inside = f"I search in {where}. " if where else ""
    goal = name.replace("{", "(").replace("}", ")")
    return "\n\n".join(
        [
            f"I am a robot, and I am to find an object for my owner: {goal}.{about}",
            f"{inside}I can recognise these categories: {', '.join(vocabulary)}.",
            (
                "Help me to search where it is worth it. For each category, rate its proximity to "
                f"the {goal}: how likely is a {goal} nearby when I am close to that category?"
            ),
            _DEFINITIONS.replace("{ooi}", goal),
            _LINES if reply == "lines" else _JSON,
        ]
    )


def build_reminder(missing: Sequence[str]) -> str:
    """Return the prompt for the categories that an answer left out, in the same form."""
    return (
        "Your answer left these categories out. Rate them too, in the same form: "
        f"{', '.join(missing)}."
    )


def reply_schema(vocabulary: Sequence[str]) -> dict[str, Any]:
    """Return the JSON Schema of an answer, for endpoints that support one."""
    rating = {
        "type": "object",
        "properties": {
            "reason": {"type": "string"},
            "level": {"type": "string", "enum": [level.name for level in Level]},
        },
        "required": ["reason", "level"],
        "additionalProperties": False,
    }
    return {
        "type": "object",
        "properties": dict.fromkeys(vocabulary, rating),
        "required": list(vocabulary),
        "additionalProperties": False,
    }


def parse_reply(text: str, vocabulary: Sequence[str]) -> ParsedReply:
    """Parse an answer in either form, also if decorated, truncated or partly invalid.

    The last rating of a category counts, because models correct themselves.
    """
    text = answer_of(text)[:MAX_REPLY_CHARS]
    by_label = {canonical_label(label): label for label in vocabulary}
    found: dict[str, LabelLevel] = {}
    unknown: list[str] = []
    for name, level, reason in list(_from_json(text)) or _from_lines(text):
        label = by_label.get(canonical_label(name))
        if label is not None:
            found[label] = LabelLevel(label=label, level=level, reason=reason)
        elif name not in unknown and len(unknown) < _MAX_UNKNOWN:
            unknown.append(name)
    return ParsedReply(
        rows=tuple(found[label] for label in vocabulary if label in found),
        missing=tuple(label for label in vocabulary if label not in found),
        unknown=tuple(unknown),
    )


_Rating = tuple[str, Level, str]
_LEVEL = r"(?P<level>certain|near|average|far)"
_MARK = r"[*_`\"'\[\](){}#|]*"
_LINE = re.compile(
    rf"(?:[-*•+]|\d{{1,3}}[.)])?\s*{_MARK}(?P<name>[^\W_][\w\- ]{{0,60}}?){_MARK}\s*[:|–—]"
    rf"(?P<reason>.*?)(?:\b|^){_LEVEL}\b{_MARK}[\s.!,;|]*$",
    re.IGNORECASE,
)
_PAIR = re.compile(
    r'"(?P<name>[^"\\\n]{1,60})"\s*:\s*(?:\{(?P<body>[^{}]*)\}|"(?P<level>[a-zA-Z]{3,8})")'
)
_FIELD = re.compile(r'"(?P<key>[a-z_]{1,20})"\s*:\s*"(?P<value>(?:[^"\\]|\\.)*)"', re.IGNORECASE)
_REASONS = ("reason", "explanation", "justification", "why")
_LEVELS = ("level", "proximity", "proximity_level", "rating")
_NAMES = ("category", "label", "object", "name")


def _from_json(text: str) -> Iterable[_Rating]:
    start = min((text.find(char) for char in "{[" if char in text), default=-1)
    if start < 0:
        return
    try:
        value, _ = json.JSONDecoder().raw_decode(text[start:])
    except (ValueError, RecursionError):  # Also of a number with thousands of digits.
        yield from _from_broken_json(text)
        return
    yield from _from_value(value, depth=0)


def _from_value(value: object, depth: int) -> Iterable[_Rating]:
    """Yield ratings by category, from a list, or from either inside an object."""
    if depth > 3:
        return
    if isinstance(value, list):
        for item in cast("list[object]", value):
            yield from _from_item(item)
    elif isinstance(value, dict):
        for name, inner in cast("dict[str, object]", value).items():
            rated = _rating(name, inner)
            if rated is not None:
                yield rated
            else:
                yield from _from_value(inner, depth + 1)


def _from_item(item: object) -> Iterable[_Rating]:
    if isinstance(item, dict):
        fields = cast("dict[str, object]", item)
        name = _first(fields, _NAMES)
        rated = _rating(name, fields) if name else None
        if rated is not None:
            yield rated


def _rating(name: str, value: object) -> _Rating | None:
    if isinstance(value, str):
        level = _level(value)
        return (_short(name), level, "") if level is not None else None
    if isinstance(value, dict):
        fields = cast("dict[str, object]", value)
        level = _level(_first(fields, _LEVELS))
        if level is not None:
            return _short(name), level, _reason(_first(fields, _REASONS))
    return None


def _from_broken_json(text: str) -> Iterable[_Rating]:
    """Yield the complete pairs of truncated or invalid JSON."""
    for match in _PAIR.finditer(text):
        if match["level"]:
            level = _level(match["level"])
            if level is not None:
                yield match["name"], level, ""
            continue
        fields: Mapping[str, object] = {
            field["key"].lower(): field["value"] for field in _FIELD.finditer(match["body"])
        }
        rated = _rating(match["name"], dict(fields))
        if rated is not None:
            yield rated


def _from_lines(text: str) -> Iterable[_Rating]:
    for line in text.splitlines():
        match = _LINE.match(line.strip(" \t|")[:2000])
        if match is not None:
            yield match["name"].strip(), Level.parse(match["level"]), _reason(match["reason"])


def _first(fields: Mapping[str, object], keys: Sequence[str]) -> str:
    return next((value for key in keys if isinstance(value := fields.get(key), str)), "")


def _level(text: str) -> Level | None:
    try:
        return Level.parse(text)
    except ValueError:
        return None


def _reason(text: str) -> str:
    return _short(plain(text).strip(" -–—:|.*_`\"'[]("), MAX_REASON_CHARS)


def _short(text: str, most: int = 60) -> str:
    return text if len(text) <= most else text[: most - 1].rstrip() + "…"


def _quoted(text: str, most: int) -> str:
    """Return a text as one line without quotation marks, so that it stays inside its sentence."""
    return plain(text)[:most].replace('"', "'").replace("“", "'").replace("”", "'").rstrip(" .")
