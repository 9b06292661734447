"""Reading of a request in one sentence: object and context."""

import re
from dataclasses import dataclass
from itertools import islice

from ippon.guidance.knowledge import Knowledge, load_knowledge
from ippon.guidance.language.context_words import RELATIONS
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.language.words import ADJECTIVES, DETERMINERS, Token, tokenize, word_set

MAX_OBJECT_CHARS = 80
MAX_SENTENCE_CHARS = 2000
"""Longer sentences are cut."""
_MAX_TRIGGERS = 8

_ASK = (
    r"(?:look|search|check|scan|comb|explore)\b[^.,;!?]{0,200}?\bfor",
    r"where did (?:\w+ ){1,3}?(?:leave|put|place|forget|drop|lose|see)",
    r"(?:what happened to|what about|how about)",
    r"(?:look|search|hunt|check|keep an eye out|watch out)(?:ing)?(?: around| out)? for",
    (
        r"(?:find|locate|seek|fetch|get|bring|grab|retrieve|spot|track down|pick up|hand|pass)"
        r"(?: me| us| out)?(?: where)?"
    ),
    r"(?:go|drive|navigate|walk|take me|lead me|guide me|head|move)(?: over)? to",
    r"(?:have|has|did) (?:you|anyone|anybody|someone|somebody) (?:seen|see|found|find)",
    r"(?:do you know|any idea|no idea|tell me|show me)(?: where| the way to)?",
    (
        r"(?:i|we)(?: really| just| still)? (?:need|want|am missing|miss|lost|misplaced|"
        r"can't find|cannot find|can not find|couldn't find|cant find|am searching for)"
    ),
    r"(?:i've|i have|we've|we have) (?:lost|misplaced)",
    (
        r"where(?: the hell| on earth)? (?:is|are|was|were|did i (?:put|leave|place)|"
        r"have i (?:put|left)|could|can|might)(?: be)?"
    ),
    r"where's|wheres",
    r"the way to",
    r"(?:i'm|i am|we are|we're) (?:looking|searching) for|(?:i'm|i am) missing",
    r"(?:the|your|our) (?:object|goal|target|item) is",
    r"is there",
    r"missing|lost|wanted|search",
    r"where",
)
_TELL = (
    r"(?:left|forgot|forgotten|put|placed|dropped|kept|laid|stored|hid|hung|had|saw|seen|leave|"
    r"took|taken|hidden|moved|brought|carried)"
)
_ASKED = re.compile(rf"\b(?:{'|'.join(_ASK)})(?:\s*:)?\s+(?=\S)", re.IGNORECASE)
_TOLD = re.compile(
    r"\b(?:i|we|he|she|they|i've|we've|somebody|someone|(?:my|our) \w+)\b[^.,;!?]{0,200}?"
    rf"\b{_TELL}\s+",
    re.IGNORECASE,
)
_PRONOUNS = word_set("it them him her one that this something")
_STOP = word_set(
    "i i'm i've i'd it it's he she we they you my which that who where when while because since "
    "maybe perhaps probably possibly please is are was were has have had should must might "
    "could that's who's can may will would but so and or if somewhere anywhere again now today "
    "yesterday quickly usually normally often sometimes last thanks thank asap also not went "
    "seems right here there lying sitting standing hanging left be been"
)
"""Words that end the name of the object."""
_VERBS = word_set("did do does doing go goes went gone come came comes get got hide hid run ran")
"""A name that contains one of them is part of a sentence."""
_PLACE = frozenset(RELATIONS) - {"with"}
_TRIM = " \t\n\r,;:.!?-–—\"'“”"
_LEAD = re.compile(
    r"^(?:(?:hey|hi|hello|ok|okay|so|well|please|kindly|robot|ippon|and|but|then|also)\b[\s,!:]*)+",
    re.IGNORECASE,
)
_TAIL = re.compile(r"[\s,]+(?:please|thanks|thank you|asap|for me)[\s.!?]*$", re.IGNORECASE)
_LEFTOVER = re.compile(
    r"^(?:(?:is|are|was|were|has|have)(?: been)? (?:missing|gone|lost|misplaced)|went|context\b:?"
    r"|and|but|so|then|please|is|are|be)"
    r"(?:[\s,.?!]+|$)",
    re.IGNORECASE,
)
_WHERE = re.compile(r"\s+for\s+$", re.IGNORECASE)
"""The text before the last word of "search the kitchen for" is a place."""
_ALSO = re.compile(r"[\s,]*(?:and|then|or)\b", re.IGNORECASE)
_BREAK = re.compile(r"[,.!?;:\n()…]|\s[-–—]+\s")


@dataclass(frozen=True, slots=True, kw_only=True)
class Query:
    """A request."""

    object: str
    """The object as written, without article; empty if there is none."""
    context: str
    doubtful: bool
    """Whether to show it for correction before the robot moves."""


def is_name(text: str) -> bool:
    """Tell whether a text is only the name of an object."""
    if len(text.split()) < 2:
        return True
    query = read_query(text)
    return not query.doubtful and not query.context and query.object == text.strip()


def read_query(sentence: str) -> Query:
    """Split a request into object and context.

    "Find my hat, I think I left it on the sofa" gives "hat" and "I think I left it on the sofa".
    """
    knowledge = load_knowledge()
    text = _TAIL.sub("", _LEAD.sub("", sentence.strip()[:MAX_SENTENCE_CHARS]))
    asked = list(islice(_ASKED.finditer(text), _MAX_TRIGGERS))
    spans = [(match, _noun_span(text, match.end(), knowledge)) for match in asked]
    named = [(match, span) for match, span in spans if span is not None]
    # "Go to the kitchen and find a mug": the room is not the object if another one follows.
    named.sort(key=lambda pair: _is_room(text[slice(*pair[1])], knowledge))
    for match, span in named:
        inner = _WHERE.search(match.group())
        before = text[: match.start()] + (match.group()[: inner.start()] if inner else "")
        return _query(text[slice(*span)], before, text[span[1] :], sure=True)
    for match in islice(_TOLD.finditer(text), _MAX_TRIGGERS):
        span = _noun_span(text, match.end(), knowledge)
        if span is not None:
            return _query(text[slice(*span)], "", text, sure=True)
    span = None if asked else _noun_span(text, 0, knowledge)
    if span is None:
        return _any_object(text, knowledge)
    return _query(text[span[0] : span[1]], "", text[span[1] :], sure=False)


def _is_room(noun: str, knowledge: Knowledge) -> bool:
    return (
        knowledge.room(" ".join(token.word for token in tokenize(_strip_article(noun)))) is not None
    )


def _query(noun: str, before: str, after: str, *, sure: bool) -> Query:
    context = _tidy(after)
    several = _ALSO.match(after) is not None and not _PLACE & {t.word for t in tokenize(after)}
    if several:
        context = ""  # A second object to find is not a place of the first.
    if before and len(tokenize(before)) > 2 and not _is_request(before):
        context = " ".join(part for part in (_tidy(before) + ".", context) if part.strip("."))
    found = resolve_object(noun, ())
    thing = load_knowledge().thing(found.canonical)
    vague = thing is not None and thing.spread == "broad"
    core = [word for word in tokenize(noun) if word.word not in ADJECTIVES | DETERMINERS]
    unsure = not found.known or found.suggestion is not None
    long = len(core) > (4 if sure else 3) or any(token.word in _VERBS for token in core)
    doubtful = unsure or vague or several or long
    return Query(object=_strip_article(noun), context=context, doubtful=doubtful)


def _is_request(text: str) -> bool:
    """Tell whether the text before the question only asks: "could you please"."""
    small = word_set(
        "can could would will you please i want need to help me hey robot kindly like try go and "
        "us let's lets now be able so dear do the a your next task job is mind just quickly should "
        "must have we i'd we'd love if know"
    )
    return all(token.word in small for token in tokenize(text))


def _noun_span(text: str, start: int, knowledge: Knowledge) -> tuple[int, int] | None:
    """Return the noun phrase that begins at an offset, or None."""
    # Names are never longer than this.
    window = tokenize(text[start : start + 3 * MAX_OBJECT_CHARS])
    tokens = [Token(token.word, token.start + start, token.end + start) for token in window]
    if not tokens or (tokens[0].word in _PRONOUNS and not _is_head(tokens)):
        return None
    taken: list[Token] = []
    for index, token in enumerate(tokens):
        if taken and _BREAK.search(text[taken[-1].end : token.start]):
            break
        named = any(
            knowledge.find(" ".join(word.word for word in tokens[index : index + length]))
            for length in (2, 3)
            if index + length <= len(tokens)
        )
        ends = token.word in _STOP or token.word in _PLACE
        if ends and not (named and token.word not in _STOP) and _has_noun(taken):
            break
        if ends and not taken and not (token.word in DETERMINERS or named):
            return None
        if token.word in _STOP and not (token.word in DETERMINERS or token.word in ADJECTIVES):
            return None
        taken.append(token)
    if not _has_noun(taken):
        return None
    end = taken[-1].end
    if end - taken[0].start > MAX_OBJECT_CHARS:
        return None
    return taken[0].start, end


def _is_head(tokens: list[Token]) -> bool:
    return len(tokens) > 1 and tokens[0].word in DETERMINERS and tokens[1].word not in _STOP


def _has_noun(tokens: list[Token]) -> bool:
    return any(token.word not in DETERMINERS for token in tokens)


def _any_object(text: str, knowledge: Knowledge) -> Query:
    """Return the first thing in the text that the table knows, as a fallback."""
    tokens = tokenize(text)
    for length in (3, 2, 1):
        for index in range(len(tokens) - length + 1):
            phrase = " ".join(token.word for token in tokens[index : index + length])
            if knowledge.find(phrase) and phrase not in ADJECTIVES | _STOP:
                return Query(object=phrase, context=_tidy(text), doubtful=True)
    return Query(object="", context=_tidy(text), doubtful=True)


def _tidy(text: str) -> str:
    text = text.strip(_TRIM)
    text = _LEFTOVER.sub("", text)
    text = _TAIL.sub("", text).strip(_TRIM)
    return re.sub(r"\s+(?:and|then|to)$", "", text, flags=re.IGNORECASE)


def _strip_article(noun: str) -> str:
    tokens = tokenize(noun)
    while len(tokens) > 1 and tokens[0].word in DETERMINERS:
        tokens.pop(0)
    return noun[tokens[0].start :].strip(_TRIM) if tokens else noun
