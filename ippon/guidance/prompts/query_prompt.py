"""Prompt for reading a request, and parsing of the answer."""

import json
from typing import Any, cast

from ippon.guidance.language.naming import resolve_object
from ippon.guidance.language.sentence import MAX_OBJECT_CHARS, Query
from ippon.guidance.language.words import plain

MAX_CONTEXT_CHARS = 2000

QUERY_SCHEMA: dict[str, Any] = {
    "type": "object",
    "properties": {"object": {"type": "string"}, "context": {"type": "string"}},
    "required": ["object", "context"],
    "additionalProperties": False,
}


def build_query_prompt(sentence: str) -> str:
    """Return the prompt for object and context of a request."""
    said = plain(sentence)[:MAX_CONTEXT_CHARS].replace('"', "'")
    return (
        "Somebody asks a robot to find an object. Take two things from the request.\n"
        '"object": the thing to find, as a short English noun phrase in the words of the request, '
        "with its attributes (red hat), without article and without a place.\n"
        '"context": everything that the request tells about where the thing is or is not, in the '
        'words of the request; "" if it tells nothing.\n'
        'If there is no thing to find, "object" is "". Answer with one JSON object with the keys '
        '"object" and "context" and nothing else.\n\n'
        f'The request: "{said}"'
    )


def parse_query_reply(text: str, sentence: str) -> Query | None:
    """Parse an answer; None if it is invalid.

    Text that is not in the request is kept and marked doubtful, so that the operator sees it before
    the robot moves.
    """
    start = text.find("{")
    if start < 0:
        return None
    try:
        value, _ = json.JSONDecoder().raw_decode(text[start:])
    except (json.JSONDecodeError, RecursionError):
        return None
    fields = cast("dict[str, object]", value)
    wanted, context = fields.get("object"), fields.get("context", "")
    if not isinstance(wanted, str) or not isinstance(context, str):
        return None
    wanted, context = plain(wanted), plain(context)[:MAX_CONTEXT_CHARS]
    if len(wanted) > MAX_OBJECT_CHARS:
        return None
    if not any(char.isalnum() for char in wanted):
        return Query(object="", context=context, doubtful=True)
    request = plain(sentence).replace('"', "'").lower()
    made_up = wanted.lower() not in request or context.lower().strip(" .") not in request
    doubtful = made_up or not resolve_object(wanted, ()).known
    return Query(object=wanted, context=context, doubtful=doubtful)
