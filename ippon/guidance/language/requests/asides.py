"""What is said to others before a request: "hang on Mike, I'm talking to the robot"."""

from typing import Final

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.requests.courtesy import skip_courtesy
from ippon.guidance.language.words import word_set

_HEARERS: Final = word_set("robot machine computer device")
_PEOPLE: Final = word_set(
    "kids children boys girls guys folks everyone everybody lads ladies love dear darling honey "
    "sweetie mum mom dad granny grandma grandpa"
)
_FILLERS: Final = word_set(
    "hang hold on wait up just only give me us gimme please for oh ah sorry excuse pardon shush "
    "hush sh shh shhh no yes not now you yet right well ok okay hey be quiet "
    "come here stop that it"
)
"""They name nothing where no more than one other word, a name, stands with them."""
_REACH: Final = 24
"""After so many words, what follows is read as another aside."""
_COUNTS: Final = word_set("one a half two the")
_COUNTED: Final = (
    _COUNTS | _HEARERS | word_set("sec secs second seconds moment minute minutes min mo tick ticks")
)
"""A moment, or the robot."""
_TALKING: Final = word_set("talking speaking chatting listening")


def skip_aside(reading: Reading, index: int) -> int:
    """Skip what is said to others, where a request follows; words that may be a thing are noted.

    Returns:
        Index after it; `index` where no such words stand.
    """
    said = reading.said
    if reading.drafts or (index and not said.breaks(index)):
        return index
    end, unsure, told = index, list[str](), False
    while end < len(said) and end - index < _REACH:
        after = end + 1
        while not said.breaks(after):
            after += 1
        name = _name_in(reading, end, after)
        lone = end == index and bool(name) and after == index + 1
        if name is None or (lone and name.lower() not in _PEOPLE):
            break
        unsure += [name] if name.islower() and name not in _PEOPLE else []
        told = told or bool(name) or not set(said.words(end, after)) <= _FILLERS
        end = after
    if not told or not _asks_later(reading, end):
        return index
    reading.unused += unsure
    reading.begin = end
    return end


def _name_in(reading: Reading, start: int, end: int) -> str | None:
    """Return the name in a clause that is said to somebody, "" for none; None for other clauses."""
    said = reading.said
    words = said.words(start, end)
    talking = bool(_TALKING & set(words)) and bool(_HEARERS & set(words))
    if talking or words[-3:] == ["on", "the", "phone"]:
        return ""
    known = _FILLERS | _COUNTED if _COUNTED & set(words) - _COUNTS else _FILLERS
    others = [n for n in range(start, end) if said.word(n) not in known]
    if len(others) > 1:
        return None
    name = said.said(others[0], others[0] + 1) if others else ""
    thing = load_knowledge().find(name.lower()) is not None and name.lower() not in _PEOPLE
    return None if thing or (name and said.word(others[0] - 1) in ("a", "the")) else name


def _asks_later(reading: Reading, start: int) -> bool:
    """Tell whether a request begins at a word or after a later comma."""
    said = reading.said
    for index in range(start, len(said)):
        if index > start and not said.breaks(index):
            continue
        asked = skip_courtesy(reading, index)
        going = phrases.GO.match(said.text, said.tokens[asked].start) if asked < len(said) else None
        if going or reading.match(phrases.ASKED, asked) > asked:
            return True
        phrase = read_noun_phrase(said, asked)
        if phrase is not None and phrase.known and phrase.determined:
            return True
    return False
