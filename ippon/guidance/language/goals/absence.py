"""What says that an object is not where it was: "but it isn't there", "not where I left it"."""

from dataclasses import replace

from ippon.guidance.language.context_polarity import was_placed
from ippon.guidance.language.context_words import NEGATIONS
from ippon.guidance.language.goals.drafts import Draft, Reading
from ippon.guidance.language.goals.features import SUBJECTS
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.relation_phrase import read_relation
from ippon.guidance.language.grammar.utterance import Utterance


def read_absence(said: Utterance, start: int, goal: Draft) -> int:
    """Read that an object is in no place that is told of it; returns the index after it."""
    return max(_not_there(said, start, goal), _not_where(said, start, goal))


def _not_there(said: Utterance, start: int, goal: Draft) -> int:
    """Read "but they aren't there": it is in no place that was told before."""
    index = start + (said.word(start) in ("and", "but", "yet"))
    if said.word(index) not in SUBJECTS:
        return start
    end = index
    while end < len(said) and said.word(end) != "there" and end - index < 4:
        end += 1
    if said.word(end) != "there" or not (NEGATIONS | {"gone"}) & set(said.words(index, end)):
        return start
    end += 1
    end += said.starts(end, ("any more", "anymore", "now"))
    if not said.breaks(end) and end < len(said):
        return start
    goal.relations = [replace(one, negated=True) for one in goal.relations]
    goal.note(said.said(start, end))
    return end


def read_gone(said: Utterance, start: int, goal: Draft) -> int:
    """Read "but it's gone" behind a place: it is no longer there; returns the index after it."""
    if not goal.relations or start >= len(said):
        return start
    match = phrases.GONE_NOW.match(said.text, said.tokens[start].start)
    end = start
    while match is not None and end < len(said) and said.tokens[end].start < match.end():
        end += 1
    first = next((n for n in range(start - 1, 0, -1) if said.ends(n)), 0)
    if match is None or not (said.word(start) == "but" or was_placed(said.words(first, start))):
        return start  # "Look in the garage, it's missing" only says why.
    goal.relations = [replace(one, negated=True) for one in goal.relations]
    goal.note(f"but {match[1]}")
    return end


def read_all_gone(reading: Reading, start: int) -> int:
    """Read "It's gone." and, of a whole list, "They're gone."; returns the index after it."""
    several = reading.said.word(start) in ("they", "they're", "they've")
    targets = reading.drafts[reading.list_start if several else -1 :]
    return max((read_gone(reading.said, start, one) for one in targets), default=start)


def _not_where(said: Utterance, start: int, goal: Draft) -> int:
    """Read "isn't where I left it, on the shelf"."""
    if start >= len(said):
        return start
    match = phrases.NOT_WHERE.match(said.text, said.tokens[start].start)
    if match is None:
        return start
    end = start
    while end < len(said) and said.tokens[end].start < match.end():
        end += 1
    place = read_relation(said, end, verbs=False) if end < len(said) else None
    if place is not None:
        for one in place.relations:
            goal.relate(replace(one, negated=True))
        end = place.end
    goal.note(said.said(start, end))
    return end
