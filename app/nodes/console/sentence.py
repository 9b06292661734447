"""Reads an object and its context from one sentence of the operator."""

import re
from typing import Final

_OPENING: Final = re.compile(
    r"""^\s*(?:please\s+|can\s+you\s+|could\s+you\s+|robot\s*,?\s+)*
        (?:(?:go\s+)?(?:find|fetch|locate|get|search\s+for|look\s+for|looking\s+for|bring\s+me)\s+
          |where(?:\s+is|\s+are|'s)\s+
          |i\s+(?:(?:have\s+|'ve\s+)?lost|need|want|(?:can't|cannot)\s+find|am\s+looking\s+for)\s+
        )(?:me\s+)?""",
    re.IGNORECASE | re.VERBOSE,
)
_ARTICLE: Final = re.compile(r"^(?:my|the|a|an|some|our|his|her|their|your)\s+", re.IGNORECASE)
_BREAK: Final = re.compile(
    r"""\s*[,;.!?:]\s*(?:and\s+)?
        |\s+(?=(?:i|we|he|she|it|they|you|there|maybe|perhaps|probably|that|which|because|in|on|at
              |near|under|behind|beside|next|last|somewhere|from)\s)""",
    re.IGNORECASE | re.VERBOSE,
)


def read_request(text: str) -> tuple[str, str]:
    """Split what the operator typed into object and context.

    "Find my hat, I left it on the sofa" gives ("hat", "I left it on the sofa"); a plain "student
    card" stays as it is, with no context.
    """
    text = " ".join(text.split())
    opened = _OPENING.sub("", text, count=1)
    if opened == text and not re.search(r"[,;.!?:]", text):
        return _ARTICLE.sub("", text), ""
    parts = _BREAK.split(opened, maxsplit=1)
    wanted = _ARTICLE.sub("", parts[0].strip())
    context = parts[1].strip(" ,;") if len(parts) > 1 else ""
    return wanted, context
