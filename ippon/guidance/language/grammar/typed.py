"""What is typed short or said to somebody: "thx", "theyre", "bring the towels, dear"."""

import re

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.words import word_set

_UNMARKED = re.compile(
    r"\b(?:(?P<be>that|there|what|where|who|he|she|here)s|(?P<are>they|you)re|(?P<have>i|we|they|you)ve"
    r"|(?P<not>do|does|did|ca|could|wo|would|should|is|are|was|were|have|has|had)nt|(?P<am>i)m)\b",
    re.IGNORECASE,
)
"""A contraction without its apostrophe."""
_STATES = word_set("asleep awake late ready")
_CONTRACTED = {"be": "'s", "are": "'re", "have": "'ve", "not": "n't", "am": "'m"}
_CHAT = re.compile(
    r",?\s*(?<![-\w'’])(?:lo+l|(?:ha){2,}h?|(?:he){2,}|omg|btw|tho|thx|tx|ty|x{2,}|lmao|rofl|smh|ngl|imo|"
    r"tbh|fyi|lmk|idc|pretty pls)(?![-\w'’])",
    re.IGNORECASE,
)
"""What is typed and says nothing."""
_SWORN = r"(?:flipping|ruddy|freaking|frigging|fucking|(?:god)?damn(?:ed)?|darn(?:ed)?|blasted)"
_SHORT = (
    (re.compile(r"\bwhere r\b", re.IGNORECASE), "where are"),
    (re.compile(r"\b(it's|they're|is|are) (?:like|kind of|sort of) (?=\w)", re.IGNORECASE), r"\1 "),
    (re.compile(r"\bur(?= \w)", re.IGNORECASE), "your"),
    (re.compile(r"\bprobs?\b", re.IGNORECASE), "probably"),
    (re.compile(r"\b(?:idk|(?:i )?dunno)\b", re.IGNORECASE), "i don't know"),
    (re.compile(r"\b(?:cuz|coz|cos)\b", re.IGNORECASE), "because"),
    (re.compile(r"\bgonna\b", re.IGNORECASE), "going to"),
    (re.compile(r"\b(?:w/ ?(?=\w)|w (?=(?:a|an|the|my|no|some) ))", re.IGNORECASE), "with "),
    (re.compile(r"\bhv\b", re.IGNORECASE), "have"),
    (re.compile(rf"\b{_SWORN} (?=\w)", re.IGNORECASE), ""),
    (re.compile(r"\bb4\b", re.IGNORECASE), "before"),
    (re.compile(r"(?<=\w\w) ['’]?n['’]? (?=\w\w)", re.IGNORECASE), " and "),
    (re.compile(r"\bright (?=(?:here|there|now)\b)", re.IGNORECASE), ""),
)
"""What is typed short."""
_CALLED = re.compile(
    r"(?<=[a-z]{3})(?<!\bour)(?<!\bthe)(?<!\bhis)(?<!\bher)(?<!\bfor)(?<!\band),? "
    r"(?:my )?(?:dear|darling|love|sweetie|sweetheart|pal|mate|buddy|bro|sis|dude|mister|miss|sir|"
    r"madam|kiddo|son)\b"
    r"(?=\s*(?:$|[.,;!?])| (?:i|i'm|i've|it|it's|they|they're|he|he's|she|she's|we|my|the|"
    r"please)\b)",
    re.IGNORECASE,
)
"""Who is spoken to, after an object: "bring the towels, dear"."""


_STATED = re.compile(
    r"\b(\w+)['’]s (\w+)(?=\s*(?:$|[.,;!?])"
    r"| (?:so|and|find|get|bring|fetch|look|where|is|are|please|can|somewhere|again)\b)",
    re.IGNORECASE,
)
"""A state of something: "the kettle's hot, get"."""
_PLACED = re.compile(
    r"\b(\w+)['’]s (\w{3,}ing)(?= (?:in|on|at|under|behind|by|near|next to|against|above|over)\b)",
    re.IGNORECASE,
)
"""How a thing is placed: "the umbrella's leaning against"."""
_ITS = re.compile(
    r"\bits (?=(?:in|on|at|under|behind|next to|near|by|not|a|an|the|my|probably|still|always|"
    r"usually|been|somewhere|dark|cold|hot|warm|late|raining|freezing)\b)",
    re.IGNORECASE,
)


def spelt_out(text: str) -> str:
    """Return a text with its contractions in full spelling and without what says nothing."""
    text = _UNMARKED.sub(_contracted, text)
    for short, said in _SHORT:
        text = short.sub(said, text)
    text = _PLACED.sub(_placed, text)
    text = _STATED.sub(_state, _ITS.sub("it's ", text))
    return _CALLED.sub(",", _CHAT.sub("", text) or text)


def _state(match: re.Match[str]) -> str:
    said, word = match.group(), match[2].lower()
    state = listed_kind(word) in ("condition", "feel") or word in _STATES
    known = load_knowledge().find(word) is not None
    busy = word.endswith("ing") and len(word) > 4
    return f"{match[1]} is {match[2]}" if (state or busy) and not known else said


def _placed(match: re.Match[str]) -> str:
    find = load_knowledge().find
    thing = find(match[1].lower()) is not None and find(match[2].lower()) is None
    return f"{match[1]} is {match[2]}" if thing else match.group()


def _contracted(match: re.Match[str]) -> str:
    kind = match.lastgroup or ""
    return match[kind] + _CONTRACTED[kind]
