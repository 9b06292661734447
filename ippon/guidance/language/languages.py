"""Which language a sentence is in, as far as that tells whether it can be read as English."""

import re
import unicodedata
from collections import Counter
from functools import cache
from importlib.resources import files
from typing import Any, Final, cast

import yaml

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context_words import ABSTRACT, BELIEFS, NEGATIONS, RELATIONS
from ippon.guidance.language.words import ADJECTIVES, DETERMINERS, plain, tokenize, word_set

UNKNOWN: Final = "another language than English"
_SCRIPTS: Final = {
    "CYRILLIC": "a language in Cyrillic script",
    "GREEK": "Greek",
    "ARABIC": "a language in Arabic script",
    "HEBREW": "Hebrew",
    "DEVANAGARI": "a language in Devanagari script",
    "THAI": "Thai",
    "HANGUL": "Korean",
    "HIRAGANA": "Japanese",
    "KATAKANA": "Japanese",
    "CJK": "Chinese or Japanese",
}
_MIN_STRANGE_WORDS = 4
"""So many words, none of them English, are no name of an object."""

_ARTICLES = word_set("le la les el los las il lo der die das den un una une o os de di da du del")
"""Names hold them: "the Le Creuset pot"; they alone make no sentence with English words foreign."""
_BEFORE_NOUNS = word_set("le la les el los las il lo der das den un una une")
"""Of these, before a thing that has no English determiner: "such den Ball" is not English."""
ENGLISH = (
    word_set(
        "i i'm i've i'd i'll me my mine myself you you're your yours he he's him his she she's her "
        "hers it it's its we we're we've us our they they're them their the a an this that these "
        "those who whose which what what's where where's wheres when why how here there is isn't "
        "are aren't was wasn't were weren't be been being am do does did done don't didn't have "
        "has had haven't hasn't can can't cannot could couldn't will would wouldn't shall should "
        "must may might and or but nor so if then than because while since until not no yes yeah "
        "of in on at by for from with without to into onto under over next near between behind "
        "front above below beside inside outside upstairs downstairs up down out off around "
        "about after before again also too as well all any some every each both either neither "
        "one two three four five six seven eight nine ten many much more most few several couple "
        "dozen other another same such only just still already very really quite maybe perhaps "
        "probably possibly think thought believe guess sure know remember left leave put see saw "
        "seen look looking looked search searching searched find finding found lost lose locate "
        "bring fetch get got grab need want like help please pls plz thanks thank hey hi hello ok "
        "okay robot now today yesterday morning evening night thing things something anything "
        "anywhere somewhere nowhere everywhere missing gone take took taken hand pass show tell "
        "give gimme go come keep kept used use last first second kindly sorry excuse good well "
        "fine actually mean let let's lemme would could spot track hunt seek retrieve misplaced "
        "forgot forgotten dropped went you'd you've who's that's there's ain't wanna gonna yo"
    )
    | ADJECTIVES
    | DETERMINERS
    | ABSTRACT
    | BELIEFS
    | NEGATIONS
    | frozenset(" ".join(RELATIONS).split())
)
"""Words by which a sentence shows that it is English."""


def other_language(sentence: str) -> str:
    """Return the language of a sentence that is not English; empty where it may be.

    A noun alone is taken as English: it may be the name of anything. What a sentence borrows from
    another language ("the café in the hall") does not make it foreign.
    """
    sentence = plain(sentence)
    script = "Spanish" if re.search("[¿¡]", sentence) else _other_script(sentence)
    if script:
        return script
    words = [token.word for token in tokenize(sentence.replace("non-", "non"))]
    known = [word for word in words if word in ENGLISH]
    table = _languages()
    counts: Counter[str] = Counter()
    for word in dict.fromkeys(words):  # The first of two languages counts, not that of a set.
        if word not in ENGLISH and word not in _things():
            counts.update(table.get(word, ()))
    for before, word, thing in zip(["", *words], words, words[1:], strict=False):
        if word in _BEFORE_NOUNS and thing in _things() and before not in DETERMINERS:
            counts.update(table.get(word, ()))
            known = []
    if not counts or (known and not set(words) & table.keys() - ENGLISH - _things() - _ARTICLES):
        return _strange(words, known)
    # Of languages with equally many own words, the one that has more of the shared ones.
    language = max(counts, key=lambda name: (counts[name], _shared(words, name)))
    enough = max(len(set(known)) - _shared_known(known), 1 + ("the" in known))
    return language if counts[language] >= enough else ""


def _shared(words: list[str], language: str) -> int:
    return sum(language in _languages().get(word, ()) for word in set(words))


def _shared_known(known: list[str]) -> int:
    """Count the English words of a sentence beyond one that other languages have, too."""
    return max(0, sum(word in _languages() for word in set(known)) - 1)


def _marked(words: list[str]) -> bool:
    return any(not word.isascii() for word in words)


def _strange(words: list[str], known: list[str]) -> str:
    things = _things()
    letters = [word for word in words if word.isalpha()]
    if set(known) - {"no"} or any(word in things for word in words):
        return ""
    enough = 2 if _marked(words) else _MIN_STRANGE_WORDS
    return UNKNOWN if len(letters) >= enough and len(set(letters)) >= enough else ""


def _other_script(sentence: str) -> str:
    scripts: Counter[str] = Counter()
    for char in sentence:
        if not char.isalpha():
            continue
        name = unicodedata.name(char, "").split(" ")[0]
        scripts["CJK" if name.startswith("CJK") else name] += 1
    total = sum(scripts.values())
    latin = scripts["LATIN"] + scripts["FULLWIDTH"]
    if not total or 2 * latin >= total:
        return ""
    if scripts["HIRAGANA"] or scripts["KATAKANA"]:
        return _SCRIPTS["HIRAGANA"]
    name = next(name for name, _ in scripts.most_common() if name not in ("LATIN", "FULLWIDTH"))
    return _SCRIPTS.get(name, UNKNOWN)


@cache
def _languages() -> dict[str, tuple[str, ...]]:
    """Map words to the languages that have them."""
    text = (files("ippon.guidance.tables.speech") / "languages.yaml").read_text(encoding="utf-8")
    # The base loader leaves every word a string: "no" and "on" are words here.
    table = cast("dict[str, list[str]]", yaml.load(text, Loader=_loader()))  # noqa: S506
    words: dict[str, list[str]] = {}
    for language, own in table.items():
        for word in dict.fromkeys(own):
            words.setdefault(word, []).append(language)
    return {word: tuple(languages) for word, languages in words.items()}


def _loader() -> Any:
    return getattr(yaml, "CBaseLoader", yaml.BaseLoader)


@cache
def _things() -> frozenset[str]:
    """Words of the names that the knowledge table has."""
    knowledge = load_knowledge()
    return frozenset(
        word for phrase in (*knowledge.phrases, *knowledge.room_names) for word in phrase.split()
    )
