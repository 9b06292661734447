"""What "the blue one", "another" and "I want the black one" refer to."""

from dataclasses import replace

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.drafts import Draft, Reading
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.noun_phrase import NounPhrase
from ippon.guidance.language.words import word_set

_POINTING = ("is that", "is this", "are those", "are these")
_IS = ("is", "are", "isn't", "aren't", "was", "were")
_ONLY = word_set("only have got found here here's")
_SOMEWHERE = word_set("here there anywhere somewhere around missing gone lost")
UNASKED = ("bare", "listed", "named", "told")


def replaced(reading: Reading, asked: str, *, other: bool) -> list[Draft]:
    """Return the objects of which only a state was told: "this pen is empty, find a new one"."""
    if asked in UNASKED or not reading.drafts:
        return []
    pointed = [one for one in reading.drafts if one.trigger.lower().startswith(_POINTING)]
    last = reading.drafts[-1]
    stated = len(last.attributes) > len(last.phrase.attributes)
    if (last.trigger.strip().lower() in _IS and not last.relations) or _is_placed(reading, last):
        return [last]  # "Is the cord long enough, or is there a longer one?"
    first = set(reading.said.words(0, 6))
    if other and last.count == 1 and "one" in first and (_ONLY & first or last.trigger == "bare"):
        return [last]  # "I can only find one sock, where is the other?"
    stated = stated or (last.gone and other)
    stated = stated or bool(last.context and not last.relations)
    return pointed or ([last] if last.trigger == "bare" and stated else [])


def complained(reading: Reading, asked: str) -> bool:
    """Tell whether of the only object before a bad state was told: "my phone is dead, find"."""
    if asked in UNASKED or len(reading.drafts) != 1:
        return False
    last = reading.drafts[0]
    if any(word in last.trigger.lower() for word in ("fancy", "kill for", "love")):
        return True  # "I fancy a cup of tea, find the teapot".
    if last.trigger.strip().lower() in _IS and not last.relations:
        heard = set(reading.said.words(last.phrase.end, last.phrase.end + 3))
        return not _SOMEWHERE & heard  # "Is the kettle on? Find a cup".
    if _is_placed(reading, last):
        reading.unused.append(reading.said.said(last.phrase.end - 1, last.phrase.end))
        return True  # "The knife is in the kitchen, find the fork".
    return is_only_stated(last)


def is_only_stated(goal: Draft) -> bool:
    """Tell whether only a state of a thing was told: "my phone is dead"."""
    stated = goal.attributes[len(goal.phrase.attributes) :]
    kinds = all(one.kind in ("condition", "feel", "quality") and not one.negated for one in stated)
    return goal.trigger == "bare" and not goal.relations and bool(stated) and kinds


def _is_placed(reading: Reading, last: Draft) -> bool:
    """Tell whether it was only said where a thing is: "the knife is in the kitchen, find"."""
    said, end = reading.said, last.phrase.end
    stated = said.word(end) in ("is", "are") and not {"it", "them"} & set(
        said.words(end, len(said))
    )
    certain = stated and not any(one.negated for one in last.relations)
    return last.trigger == "bare" and not last.gone and certain and bool(last.relations)


def selects(last: Draft, asked: str) -> bool:
    """Tell whether "I want the black one" selects from what was told before."""
    wanted = asked.lower().startswith(("i ", "we ", "i'd", "we'd", "i'm"))
    return last.trigger.lower().startswith("there") or (wanted and last.trigger != asked)


def describes_declined(reading: Reading, phrase: NounPhrase) -> bool:
    """Tell whether "the dry towel" is meant in place of "the wet towel" that was declined."""
    declined = reading.declined
    if declined is None or reading.drafts or declined.head != phrase.head:
        return False
    return bool(declined.attributes and phrase.attributes)


def refer(reading: Reading, goal: Draft) -> None:
    """Let "the blue one" name what was asked for before."""
    before = next((one.head for one in reversed(reading.drafts) if one.head), "")
    declined = reading.declined
    if not before and declined is not None and declined.head:
        before = declined.head
        goal.attributes += [replace(one, negated=True) for one in declined.attributes]
        reading.unused.pop()
    if not before and reading.subject:
        before = reading.subject.head
    if not before and reading.previous:
        before = reading.previous[-1].object
        goal.reference = goal.reference or "same"
    nouns = [one for one in goal.attributes if one.kind == "other" and not listed_kind(one.value)]
    if len(before.split()) > 1 and nouns and load_knowledge().find(before.split()[-1]) is not None:
        # "An HDMI cable or a VGA one."
        before = " ".join([*(one.value for one in nouns), before.split()[-1]])
        goal.attributes = [one for one in goal.attributes if one not in nouns]
    if before:
        goal.head = before
        said = [one.value for one in goal.attributes if not one.negated]
        goal.display = " ".join([*said, before])
