"""Replies of language models: the answer without the thoughts before it, and its JSON object."""

import json
import re
from typing import Any, Final

_THOUGHT: Final = re.compile(
    r"<think(?:ing)?>.*?(?:</think(?:ing)?>|\Z)", re.IGNORECASE | re.DOTALL
)
_THOUGHT_END: Final = re.compile(r"</think(?:ing)?>", re.IGNORECASE)


def answer_of(text: str) -> str:
    """Return a reply without its thoughts, which some endpoints leave in it.

    A thought without a beginning is one that the endpoint began in the question.
    """
    return _THOUGHT_END.split(_THOUGHT.sub(" ", text))[-1]


def object_in(answer: str) -> dict[str, Any] | None:
    """Return the JSON object that begins at the first brace of an answer; None if there is none."""
    start = answer.find("{")
    if start < 0:
        return None
    try:
        value, _ = json.JSONDecoder().raw_decode(answer[start:])
    except (ValueError, RecursionError):  # Also of a number with thousands of digits.
        return None
    return value
