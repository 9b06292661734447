"""A sentence as a list of words: fillers and repetitions removed, misspelt verbs corrected."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache, lru_cache, wraps
from typing import Any, Concatenate, ParamSpec, TypeVar, cast

from rapidfuzz.distance import OSA

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context_words import RELATIONS
from ippon.guidance.language.grammar.number_words import in_digits
from ippon.guidance.language.grammar.reordered import in_order
from ippon.guidance.language.grammar.typed import spelt_out
from ippon.guidance.language.languages import ENGLISH
from ippon.guidance.language.words import ADJECTIVES, Token, plain, tokenize

_FILLER = r"\b(?:u+h+m*|u+m+|erm?|e+h+|h+m+|m{3,}|a+h+)\b[\s,.…]*"
_FILLERS = re.compile(_FILLER, re.IGNORECASE)
_RESTART = re.compile(
    rf"\b((?:{'|'.join(sorted(RELATIONS, key=len, reverse=True))}) )"
    rf"((?:(?:the|my|our|a|an|his|her) )?\w+(?: \w+)?),? {_FILLER}(?=\1)",
    re.IGNORECASE,
)
"""A place that is said anew after a hesitation: "on the table, er, on the shelf"."""
_WORD_SOUGHT = re.compile(
    r"(?:\b(?:the|a|an|my)\b[\s,.…]+)?\b(?:what's|what is|whats|what do you|what d'you|how do you)"
    r" (?:(?:it|that|its name|they|them) called|call (?:it|that|them)|say(?: it)?)\b[\s,.…?]*"
    r"(?=(?:the|a|an|my) )",
    re.IGNORECASE,
)
"""What fills the time while a word is sought: "the, what's it called, the tin opener"."""
_REPEATED = re.compile(r"\b([a-z']+)(?:\s+\1\b)+", re.IGNORECASE)
_THRICE = re.compile(r"\b([a-z']+)(?:\s+\1\b){2,}", re.IGNORECASE)
_CORRECTING = r"(?:(?:no|wait|sorry|i mean|actually|or rather|make that|hang on|hold on)\b,? )+"
_DETERMINER = r"(?:the|my|our|his|her|their|a|an|some|another)"
_NUMBER = r"(?:\d+|one|two|three|four|five|six|seven|eight|nine|ten|eleven|twelve)"
_TAKEN_BACK = re.compile(
    rf"\b(?:{_DETERMINER},? {_CORRECTING}(?={_DETERMINER}\b)"
    rf"|{_DETERMINER} (\w+(?: \w+)?),? (?:well,? )?not {_DETERMINER} \1,? (?={_DETERMINER}\b)"
    rf"|{_NUMBER},? {_CORRECTING}(?={_NUMBER}\b))",
    re.IGNORECASE,
)
"""What is said anew: "my, no wait, the other", "a bag, not a bag, a case", "two, no, three"."""
_PRONOUN = r"(?:it|them|those|these|that|this|both|one|any)"
_SOMEBODY = r"someone|somebody|anyone|anybody"
_AFTERWARDS = re.compile(
    rf"\b(?:and,? )?(?:after (?:those|these)\b|(?:once|when|after|as soon as) (?:you|that|this|it)"
    rf"(?:'s|'re|'ve| is| are| have| has)? (?:(?:done|finished)(?: with)?(?: {_PRONOUN})?|"
    rf"(?:have|find|found|get|got|located|collected|finish|finished) {_PRONOUN}))"
    r"(?=,? \w)(?! (?:in|on|at|under|with|to)\b),?",
    re.IGNORECASE,
)
_FAILING = re.compile(
    rf"\b(?:or,? )?(?:if (?:there (?:isn't|aren't|(?:is|are) (?:not|no|none))(?: {_PRONOUN}| left)*"
    rf"|you (?:can't|cannot|can not|don't|couldn't) (?:find|see|get|locate) {_PRONOUN}"
    rf"|(?:it|that|they|those)(?:'s|'re| is| are)?(?:n't| not) (?:there|available))),?"
    r"(?= (?:the|a|an|my|some|another|any|his|her|our)\b| \w+[.!?]*$)"
    rf"|\bor,? if (?:we|you|i)(?:'re| are|'ve| have) (?:all )?(?:out|run out|got none|none left),"
    rf"|(?<=\S )(?:\b(?:or|and),? )?\bif (?:it|that|this|they|those|{_SOMEBODY})"
    r"(?:'s|'re| is| are| has) (?!on |under |at |near |by |behind |next |not |there)"
    r"(?:in )?(?:\w+),?(?= (?:(?:the|a|an|my|some|another|his|her|our)\b"
    r"|(?:find|get|bring|take|look for)\b)|(?<=,) \w+[.!?]*$)",
    re.IGNORECASE,
)
"""Conditions that only say which object comes after, and which in place of another."""
_POINTED = re.compile(
    r"\b(not|never|except(?: for)?|but) (?:that|those)(?= (?:in|on|at|under|behind|near|by|"
    r"next to|beside|from|with|without|above|below|inside|outside|between)\b)",
    re.IGNORECASE,
)
"""What is not meant: "not that on the bed"."""
_NUMBERED = re.compile(r"(?:^|\s)[1-9a-e][.)]\s+(?=[^\W\d])")
"""A number of a list: "1. hammer 2. nails"."""
_EARLY = re.compile(r"[^\W\d_]{3,}")
_VERBS = ("find", "where", "search", "looking", "bring", "fetch", "locate", "please", "look")
_BREAK = re.compile(r"[,.!?;:\n()\[\]…]|\s[-–—]+\s|[–—]")
_HARD = re.compile(r"[.!?;\n…]")
_SOUND = (
    (re.compile(r"\b(?:teh|hte)\b", re.IGNORECASE), "the"),
    (re.compile(r"\bwere (?=(?:is|are|did|have|do|can)\b)", re.IGNORECASE), "where "),
    (re.compile(r"\bcan (?:find|see) neither\b", re.IGNORECASE), "can't find"),
    (re.compile(r"\b(it|he|she|they|that|there)['’]ll\b", re.IGNORECASE), r"\1 will"),
    (re.compile(r"\bout(?:t?a|ta)\b", re.IGNORECASE), "out of"),
    (re.compile(r"\bor, (?:even )?better(?: still| yet)?,", re.IGNORECASE), "or"),
    (
        re.compile(
            r"\b(where|what|who) (?:on earth|in the world|in \w+'s name|the (?:hell|heck)|exactly)"
            r"\b",
            re.IGNORECASE,
        ),
        r"\1",
    ),
    (re.compile(r"\bno[- ]one\b(?!['’])", re.IGNORECASE), "nobody"),
    (re.compile(r"\bnot only(?= (?:the|an?|my|our|his|her|their)\b)", re.IGNORECASE), ""),
    (
        re.compile(
            r"\b(?:(?:i|we) have )?(?:no|without(?: a| any)?) doubt\b(?: that)?", re.IGNORECASE
        ),
        "certainly",
    ),
    (re.compile(r"\bmind (look|check|search)ing\b", re.IGNORECASE), r"please \1"),
    (re.compile(r"\bno (?:idea|clue)(?= (?:where|which|who)\b)", re.IGNORECASE), "i don't know"),
    (re.compile(r",? no (?:luck|hurry|rush|worries)(?: there)?(?=[,.;!?]|$)", re.IGNORECASE), ""),
    (re.compile(r"\bwhere['’]d\b", re.IGNORECASE), "where did"),
    (re.compile(r"(?<=\w),? for the life of me\b,?", re.IGNORECASE), ""),
    (
        re.compile(
            r"\b(?:literally|honestly|seriously|basically|absolutely|simply|truly),? "
            r"(?=(?:just )?(?:any|every|all|the|my|a|an)\b)",
            re.IGNORECASE,
        ),
        "",
    ),
    (
        re.compile(
            r"['’]s (?=(?:(?:taken|moved|stolen|hidden|borrowed|got|vanished|disappeared|escaped)\b"
            r"|(?:left|put|lost|dropped|forgotten|brought|used) (?:the|an?|my|our|his|her|their)"
            r"\b))",
            re.IGNORECASE,
        ),
        " has ",
    ),
    (
        re.compile(
            r"\b(?:it's|it is) not ((?:the|my) [^,.;!?]{2,40}?) (?:that )?(?:i|we) "
            r"(?:want|need|mean|am after),? (?:but|it's|it is) (?=(?:the|my) )",
            re.IGNORECASE,
        ),
        r"not \1 but ",
    ),
    (re.compile(r"(?<=[a-z]) (\d+)\s?[x×]\s+(?=[^\W\d])", re.IGNORECASE), r", \1 "),
    (re.compile(r"(?<=\d)\s?[x×]\s+(?=[^\W\d])", re.IGNORECASE), " "),
    (
        re.compile(
            r"\blast (?:i|we) saw(?: it| them)?,? (?=(?:it|they|was|were)\b)", re.IGNORECASE
        ),
        "it ",
    ),
    (re.compile(r"(?<=\w) or so\b", re.IGNORECASE), ""),
    (
        re.compile(r"(?<=\w)(,?) (?<!as )(?:even |al)?(?:though|however),?(?= \w)", re.IGNORECASE),
        r"\1 but",
    ),
    (re.compile(r"\bnon-(?=\w)", re.IGNORECASE), "non"),
    (re.compile(r"\s+comma\b(?=\s)", re.IGNORECASE), ","),
    (re.compile(r"\s+full stop\b", re.IGNORECASE), "."),
    (re.compile(r"(?<=\w )4 (?=(?:my|the|an?|our|some) )", re.IGNORECASE), "for "),
    (re.compile(r"\bhi[- ]?(?=vis\b)", re.IGNORECASE), "high "),
    (re.compile(r",?\s*\bby (?:any )?chance\b,?", re.IGNORECASE), ""),
    (re.compile(r"\b(mrs?|ms|dr|st|prof)\.", re.IGNORECASE), r"\1"),
    (re.compile(r"\s*[&+]\s*(?=\D)"), " and "),
    (re.compile(r'(?<=\d)\s*(?:"|”|″|\'\')'), " inch "),
    (re.compile(r"(?<=\d)[.,](?=\d)"), "\u2024"),
    (re.compile(r"(?<=\d)(?=(?:l|ml|cm|mm|m|kg|g|inch|litres?|liters?)\b)", re.IGNORECASE), " "),
    (
        re.compile(
            r"\b(\w+)['’]s (?=(?:been|not|in|on|at|under|behind|near|next to|beside|above|"
            r"upstairs|downstairs|somewhere|probably|gone|missing|lost)\b)",
            re.IGNORECASE,
        ),
        r"\1 is ",
    ),
    (
        re.compile(r"\s*[/;,]?\s*\b(?:colou?r|size|material|type|brand)\s*[:=]\s*", re.IGNORECASE),
        ", ",
    ),
    (re.compile(r"\b(?:location|place|position)\s*[:=]\s*", re.IGNORECASE), "at "),
    (re.compile(r"(?:^|(?<=[,;/] ))room\s*[:=]\s*", re.IGNORECASE), "in "),
    (re.compile(r"\s*/\s*"), " or "),
    (re.compile(r"(?<=s)'(?=\s)"), "’s"),
)
"""How a sign is said. A decimal separator becomes a sign that ends no word, and the s of an owner
"parents'" gets another apostrophe than that of "James's"."""


@dataclass(slots=True)
class Utterance:
    """The words of a sentence and the punctuation between them."""

    text: str
    tokens: list[Token] = field(default_factory=list)
    read: dict[tuple[Any, ...], Any] = field(default_factory=dict, repr=False, compare=False)
    """What `read_once` functions have read, by function, index and options."""
    _gaps: list[tuple[bool, bool]] = field(init=False, repr=False, compare=False)
    """Of each word, whether a comma or a stronger sign, and whether an end stands before it."""

    def __post_init__(self) -> None:
        """Find the signs between the words, which are asked for most often."""
        gaps = map(self.gap, range(len(self.tokens)))
        self._gaps = [(bool(_BREAK.search(gap)), bool(_HARD.search(gap))) for gap in gaps]

    def __len__(self) -> int:
        return len(self.tokens)

    def word(self, index: int) -> str:
        """Return a word; empty beyond the end."""
        return self.tokens[index].word if 0 <= index < len(self.tokens) else ""

    def words(self, start: int, end: int) -> list[str]:
        """Return the words of a range."""
        return [token.word for token in self.tokens[start:end]]

    def gap(self, index: int) -> str:
        """Return what stands between a word and the one before."""
        if not 0 < index < len(self.tokens):
            return "." if index >= len(self.tokens) else ""
        return self.text[self.tokens[index - 1].end : self.tokens[index].start]

    def breaks(self, index: int) -> bool:
        """Tell whether a comma or a stronger sign stands before a word."""
        return index >= len(self._gaps) or (index > 0 and self._gaps[index][0])

    def hyphened(self, index: int) -> bool:
        """Tell whether a word belongs to the one before: "in" of "walk-in"."""
        return self.gap(index) in ("-", "‐", "‑")

    def ends(self, index: int) -> bool:
        """Tell whether a sentence ends before a word."""
        return index >= len(self._gaps) or (index > 0 and self._gaps[index][1])

    def said(self, start: int, end: int) -> str:
        """Return a range of words as they were said."""
        if start >= end:
            return ""
        said = self.text[self.tokens[start].start : self.tokens[end - 1].end]
        return said.replace("\u2024", ".").replace("s’s ", "s' ")

    def starts(self, index: int, phrases: Iterable[str]) -> int:
        """Return the number of words of the longest phrase that stands at an index; 0 for none."""
        return next(
            (
                len(parts)
                for parts in _by_first_word(tuple(phrases)).get(self.word(index), ())
                if self.words(index, index + len(parts)) == parts
            ),
            0,
        )

    def corrected(self, index: int, corrections: Iterable[str]) -> int:
        """Return the index after what takes back the words before: "and no, never mind"."""
        joined = self.word(index) in ("and", "but", "oh")
        end = index + joined
        while length := self.starts(end, corrections):
            end += length
        return index if end - index <= joined + (joined and self.word(end - 1) != "no") else end


_Options = ParamSpec("_Options")
_Found = TypeVar("_Found")


def read_once(
    read: Callable[Concatenate[Utterance, int, _Options], _Found],
) -> Callable[Concatenate[Utterance, int, _Options], _Found]:
    """Let a function that depends on sentence, index and options alone run once for each.

    The readers try one after the other at the same words: without it, a long sentence costs the
    square of its length, and words that nest ("from off from off") more than that.
    """

    @wraps(read)
    def reading(
        said: Utterance, index: int, *args: _Options.args, **options: _Options.kwargs
    ) -> _Found:
        key = (read, index, *args, *options.items())
        if key not in said.read:
            said.read[key] = read(said, index, *args, **options)
        return cast("_Found", said.read[key])

    return reading


@cache
def _by_first_word(phrases: tuple[str, ...]) -> dict[str, list[list[str]]]:
    """Return the words of phrases by the first of them, the longest phrases first."""
    found: dict[str, list[list[str]]] = {}
    for phrase in sorted(phrases, key=lambda phrase: -len(phrase.split())):
        parts = phrase.split()
        found.setdefault(parts[0], []).append(parts)
    return found


def hear(sentence: str) -> Utterance:
    """Take a sentence apart into words."""
    text = plain(re.sub(r"[\r\n]+", ". ", sentence))
    if _NUMBERED.match(text):
        text = _NUMBERED.sub(", ", text).lstrip(" ,")
    text = in_digits(in_order(spelt_out(text)))
    text = _POINTED.sub(r"\1 the one", text)
    for sign, said in _SOUND:
        text = sign.sub(said, text)
    text = _FILLERS.sub("", _RESTART.sub(_restart, text))
    text = _TAKEN_BACK.sub("", _WORD_SOUGHT.sub("", text))
    text = _FAILING.sub("or else", _AFTERWARDS.sub("then", text))
    text = _REPEATED.sub(_once, _THRICE.sub(r"\1", text))
    text = _EARLY.sub(lambda match: _verb(match.group().lower()) or match.group(), text, count=4)
    return Utterance(text, _whole_numbers(text, tokenize(text)))


def _once(match: re.Match[str]) -> str:
    word = match.group(1).lower()
    return match.group(1) if word in ENGLISH and word not in ADJECTIVES else match.group()


def _restart(match: re.Match[str]) -> str:
    place = match.group(2).lower().removeprefix("the ")
    narrows = load_knowledge().room(place) is not None  # "In the kitchen, um, in the drawer".
    return match.group() if narrows else f"{match.group(1)}{match.group(2)}, no, "


@cache
def named_words() -> frozenset[str]:
    """Return the words of all names of the table: "lock" of "bike lock"."""
    return frozenset(word for name in load_knowledge().phrases for word in name.split())


@lru_cache(maxsize=1024)
def _verb(word: str) -> str:
    if word in ENGLISH or word in named_words():
        return ""
    if word.removesuffix("s") in _VERBS:
        return ""  # "Looks like a cat".
    near = [verb for verb in _VERBS if OSA.distance(word, verb) == 1 and word[0] == verb[0]]
    return near[0] if near else ""


def _whole_numbers(text: str, tokens: list[Token]) -> list[Token]:
    """Join the digits around a decimal separator into one word."""
    joined: list[Token] = []
    for word in tokens:
        token = word
        if joined and text[joined[-1].end : token.start] == "\u2024":
            last = joined.pop()
            token = Token(f"{last.word}.{token.word}", last.start, token.end)
        joined.append(token)
    return joined
