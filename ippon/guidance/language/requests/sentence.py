"""Reads a sentence: the objects, their attributes and their possible places."""

import string
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.context_text import context_text
from ippon.guidance.language.goals.drafts import Draft, draft
from ippon.guidance.language.goals.goal import Goal, Request, unchecked
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.phrases import CODE, OTHER_TASKS, PRONOUNS, SAME, STOP
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.grammar.utterance import hear, named_words
from ippon.guidance.language.languages import ENGLISH, other_language
from ippon.guidance.language.naming import TOYS, is_instance_of, resolve_object
from ippon.guidance.language.requests.reader import RequestReader
from ippon.guidance.language.requests.traces import lost_words
from ippon.guidance.language.requests.withdrawn import withdrawn
from ippon.guidance.language.words import is_many

MAX_OBJECT_CHARS: Final = 80
MAX_CONTEXT_CHARS: Final = 2000
MAX_SENTENCE_CHARS: Final = 2000
"""What follows is not read."""
MAX_GOALS: Final = 20
_AROUND: Final = string.whitespace + string.punctuation + "…“”‘’"
_SAY_IT: Final = 'say what to look for, like "find the red mug and my keys"'


def read_request(sentence: str, previous: Sequence[Goal] = ()) -> Request:
    """Read what a sentence asks for.

    Args:
        sentence: What a person says, in English. Of more than `MAX_SENTENCE_CHARS` characters, the
            first are read.
        previous: Goals of the request before, for "the other one" and "the same again".
    """
    text = sentence.strip()[:MAX_SENTENCE_CHARS]
    if CODE.search(text):
        return _nothing(f"this reads like code, not like a request; {_SAY_IT}", text)
    language = other_language(text)
    if language:
        because = (
            f"this looks like {language}, and rules read English only: say it in English, or name "
            "a language model with --llm.model, which reads any language"
        )
        return Request(goals=(), doubtful=True, because=because, unused=(), language=language)
    said = hear(text)
    if not len(said):
        return _nothing(f"there is no word in it; {_SAY_IT}", text)
    if SAME.match(said.said(0, len(said))):
        return _again(text, previous)
    reader = RequestReader(said, previous)
    reading = reader.read()
    changing, names = lost_words(reading) if reading.drafts else ([], [])
    reading.stray += [*changing, *withdrawn(reading)]
    reading.unused += names
    request = _judge(reading.drafts, reading.unused, reading.stray)
    if len(sentence.strip()) > MAX_SENTENCE_CHARS:
        rest = f"everything after {MAX_SENTENCE_CHARS} characters"
        return replace(
            request,
            doubtful=True,
            because=_joined(request.because, f"{rest} was not read: say it shorter"),
            unused=(*request.unused, rest),
        )
    return request


def is_name(text: str) -> bool:
    """Tell whether a text is the name of an object and nothing else, so that none need read it.

    One word is a name, unless it is known to be of another language, or names nothing ("again",
    "stop").
    """
    if len(text.split()) < 2:
        word = text.strip(_AROUND).lower()
        order = word in ENGLISH or word in STOP or word in PRONOUNS or word in OTHER_TASKS
        return load_knowledge().find(word) is not None or not (order or other_language(text))
    request = read_request(text)
    if request.doubtful or request.unused or len(request.goals) != 1:
        return False
    goal = request.goals[0]
    plain = not goal.context and not goal.relations and goal.count == 1 and not goal.refers_to
    return plain and goal.display == text.strip()


def goal_named(name: str) -> Goal | None:
    """Return what the name of an object says: two and red of "two red mugs"; None without one."""
    phrase = read_noun_phrase(hear(name[:MAX_OBJECT_CHARS]), 0)
    return draft(phrase).goal() if phrase is not None and phrase.head else None


def name_notes(name: str) -> tuple[str, ...]:
    """Return what the name of an object says that a search does not use yet."""
    goal = goal_named(name)
    return () if goal is None else unchecked(goal)


def search_name(goal: Goal) -> str:
    """Return the text that a search for a goal is given: attributes stay where they may help."""
    if len(goal.display) > MAX_OBJECT_CHARS:
        return goal.object[:MAX_OBJECT_CHARS]
    full = resolve_object(goal.display, ())
    fits = is_instance_of(full.canonical, resolve_object(goal.object, ()).canonical)
    return goal.display if fits else goal.object


def _nothing(because: str, text: str) -> Request:
    unused = (text[:200],) if text else ()
    return Request(goals=(), doubtful=True, because=because, unused=unused)


def _again(text: str, previous: Sequence[Goal]) -> Request:
    if not previous:
        return _nothing(f"“{text[:60]}” refers to an earlier request, but there was none", text)
    goals = tuple(replace(goal, refers_to="same") for goal in previous)
    return Request(goals=goals, doubtful=False)


def _judge(drafts: list[Draft], unused: list[str], stray: list[str]) -> Request:
    """Say what is doubtful in what was read."""
    reasons: list[str] = []
    goals = [read.goal() for read in drafts]
    told = [read for read in drafts if read.trigger == "told"]
    if told and any(read.trigger not in ("told", "listed") for read in drafts):
        unused = [*unused, told[0].display]
    if len(goals) > MAX_GOALS:
        left = ", ".join(goal.display for goal in goals[MAX_GOALS:])
        reasons.append(f"at most {MAX_GOALS} objects are read at once; left out: {left[:200]}")
        unused = [*unused, left[:200]]
        del goals[MAX_GOALS:]
    lost = [goal for goal in goals if not goal.object]
    if lost:
        reasons.append("it refers to an object before, and there was none")
        pairs = [(read, goal) for read, goal in zip(drafts, goals, strict=False) if goal.object]
        drafts, goals = [read for read, _ in pairs], [goal for _, goal in pairs]
    if not goals:
        reasons.append(f"no object was found in it; {_SAY_IT}")
    for read, goal in zip(drafts, goals, strict=False):
        reasons += _doubts(read, goal)
    reasons += [f"“{words}” was not understood" for words in stray]
    texts = [
        context_text(read.context, goal.relations, goal.object)[:MAX_CONTEXT_CHARS]
        for read, goal in zip(drafts, goals, strict=False)
    ]
    goals = [replace(goal, context=text) for goal, text in zip(goals, texts, strict=True)]
    return Request(
        goals=tuple(goals),
        doubtful=bool(reasons),
        because="; ".join(dict.fromkeys(reasons)),
        unused=tuple(dict.fromkeys([*stray, *unused])),
    )


def _doubts(read: Draft, goal: Goal) -> list[str]:
    if len(goal.object) > MAX_OBJECT_CHARS:
        return [f"“{goal.object[:40]}…” is longer than the name of an object"]
    reasons: list[str] = []
    found = resolve_object(goal.object, ())
    thing = load_knowledge().thing(found.canonical)
    if is_room(goal.object):
        reasons.append(f"“{goal.object}” is a room, not an object")
    elif read.phrase.corrected:
        reasons.append(f"“{goal.object}” is a corrected spelling")
    elif not found.known and found.suggestion:
        reasons.append(
            f"“{goal.object}” is not in the table of objects: did you mean “{found.suggestion}”?"
        )
    elif not found.known:
        reasons.append(f"“{goal.object}” is not in the table of objects")
    elif thing is not None and thing.spread == "broad":
        reasons.append(f"“{goal.object}” may be anything")
    if _may_end_in_verb(goal.object, read.phrase.display):
        reasons.append(f"“{goal.object}” may be more than a name")
    if read.phrase.crowded:
        reasons.append(f"“{read.phrase.crowded}” may be several objects: say “and” between them")
    if len(goal.object.split()) > 4:
        reasons.append(f"“{goal.object}” is long for the name of an object")
    return reasons


def _may_end_in_verb(name: str, spoken: str) -> bool:
    """Tell whether the last word of a name may be a verb: "the pump beeps"."""
    find = load_knowledge().find
    first, _, last = name.rpartition(" ")
    # No name of the table has the last word: "helmet thx", but not "cake stand".
    whole = find(first) is not None and first not in TOYS
    whole = whole and not (last in named_words() or last[:1].isdigit())
    odd = spoken.endswith(("s", "ed")) or listed_kind(last) is not None or last in ENGLISH
    before = spoken.rpartition(" ")[0]
    several = before.endswith("s") and not is_many(before)  # "The towels beep".
    return bool(first) and not (find(name) or find(last)) and (odd or several or whole)


def _joined(first: str, second: str) -> str:
    return f"{first}; {second}" if first else second
