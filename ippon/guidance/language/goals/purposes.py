"""What an object is for, about, and does: "for the living room", "that is ringing"."""

from ippon.guidance.language.goals.drafts import Draft
from ippon.guidance.language.goals.features import BE, PLACES_ON_IT, SUBJECTS
from ippon.guidance.language.goals.goal import Attribute, Relation
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.determiners import NUMBERS
from ippon.guidance.language.grammar.guesses import as_guessed, is_guessed_before
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.phrases import PREPOSITIONS, STOP
from ippon.guidance.language.grammar.places import is_searched_inside
from ippon.guidance.language.grammar.relation_phrase import read_relation
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.words import word_set

_PEOPLE = word_set("me us him her them you my mine")
_IDIOMS = word_set("life sake goodness")
_GOING_ON = (
    "keeps", "keep", "kept", "keeps on", "won't stop", "will not stop", "doesn't stop",
    "never stops", "started", "starts", "always", "is always",
)  # fmt: skip
"""Between "that" and what a thing does: "that keeps beeping"."""


def read_topic(said: Utterance, start: int, goal: Draft) -> int:
    """Read "about cooking", "called Dune": what it is a picture or a book of."""
    index = start + (said.word(start) in SUBJECTS)
    index += said.word(index) in ("is", "are", "was", "were")
    length = said.starts(index, phrases.TOPIC)
    word = said.word(index + length)
    if not length or said.breaks(index + length) or word in _PEOPLE or word in ("and", ""):
        return start
    if said.word(index) == "for":
        return start
    if said.word(index) == "about" and word in NUMBERS and said.breaks(index + 2):
        goal.count = NUMBERS[word]
        return index + 2  # "Bibs, about ten".
    end = index + length
    while end < len(said) and not said.breaks(end) and end - index < 6:
        if (
            said.word(end) in ("and", "or", "then", "that", "which")
            or said.word(end) in PREPOSITIONS
        ):
            break
        end += 1
    if end == index + length:
        return start
    goal.add(Attribute(kind="feature", value=said.said(index, end)))
    return end + said.starts(end, PLACES_ON_IT)


def read_purpose(said: Utterance, start: int, goal: Draft) -> int:
    """Read "for the living room" and "to the shed": what or whom it is for."""
    to = said.word(start) == "to" and said.word(start + 1) in ("the", "my", "our", "a")
    if not (to or said.word(start) == "for") or said.breaks(start + 1):
        return start
    phrase = read_noun_phrase(said, start + 1)
    if phrase is None or not phrase.head:
        return start
    if phrase.head.split()[-1] in _IDIOMS:
        return phrase.end  # "For the life of me".
    if to and goal.trigger == "told":
        relation = "in" if is_searched_inside(phrase.head) else "at"
        if is_guessed_before(said, start):
            goal.note(as_guessed(said, start, phrase.end))
        else:
            goal.relate(Relation(relation=relation, place=phrase.head))
            goal.note(said.said(start, phrase.end))
        return phrase.end  # "Dad took the ladder to the garage".
    end = phrase.end
    if not phrase.known and phrase.determined and (at := read_relation(said, end, verbs=False)):
        end = at.end  # "For the lady on the sofa".
    goal.add(Attribute(kind="feature", value=said.said(start, end)))
    return end


def read_activity(said: Utterance, start: int, goal: Draft) -> int:
    """Read "that is ringing", "which fits this pot", "that keeps beeping": what it does."""
    if (begin := _goes_on(said, start)) > start:
        end = _clause_end(said, begin + 1)
        end += end < len(said) and said.word(end) in PREPOSITIONS and said.breaks(end + 1)
        goal.add(Attribute(kind="feature", value=said.said(begin, end)))
        return end  # "That keeps going off".
    if (end := _where_things_are(said, start)) > start:
        goal.add(Attribute(kind="feature", value=said.said(start, end)))
        return end
    if (end := _done_to(said, start)) > start:
        goal.add(Attribute(kind="feature", value=said.said(start, end)))
        return end
    if said.word(start) not in ("that", "which") or said.breaks(start + 1):
        return start
    index = start + 1
    index += said.word(index) in ("still", "always", "only", "also", "just", "really", "actually")
    verb, following = said.word(index), said.word(index + 1)
    acts = verb in ("is", "are") and following.endswith("ing") and len(following) > 4
    does = verb in ("doesn't", "don't", "can", "can't", "won't") and following not in STOP
    plain = (
        verb.endswith("s")
        and not verb.endswith("ss")
        and (verb not in STOP | BE | {"has", "belongs"} or verb in ("needs", "wants"))
    )
    if not (acts or does or plain) or (said.breaks(index + 1) and not plain):
        return start
    end = _clause_end(said, index + 1 + (acts or does))
    begin = index + 1 if acts else start + 1
    goal.add(Attribute(kind="feature", value=said.said(begin, end)))
    return end


def _done_to(said: Utterance, start: int) -> int:
    """Return the index after "addressed to Ms Lind" or "tied with string"; the same for none."""
    word, joint = said.word(start), said.word(start + 1)
    passive = joint in ("with", "by", "for") or (word, joint) == ("addressed", "to")
    passive = passive and word.endswith("ed") and len(word) > 3 and not said.breaks(start)
    phrase = read_noun_phrase(said, start + 2) if passive and not said.breaks(start + 2) else None
    return start if phrase is None else phrase.end


def _where_things_are(said: Utterance, start: int) -> int:
    """Return the index after "where the knives are"; the same for none."""
    phrase = read_noun_phrase(said, start + 1) if said.word(start) == "where" else None
    if phrase is None or not phrase.head or said.breaks(start) or said.breaks(phrase.end):
        return start
    end = phrase.end + 1
    return end if said.word(phrase.end) in BE and said.breaks(end) else start


def _goes_on(said: Utterance, start: int) -> int:
    """Return the index of what a thing keeps doing: "that won't stop beeping"; else the same."""
    if said.word(start) not in ("that", "which", "that's"):
        return start
    index = start + 1 + said.starts(start + 1, _GOING_ON)
    doing = said.word(index)
    busy = index > start + 1 and doing.endswith("ing") and len(doing) > 4
    return index if busy and not said.breaks(index) else start


def _clause_end(said: Utterance, index: int) -> int:
    """Return the index of the first word that ends what a thing does."""
    while index < len(said) and not said.breaks(index):
        if said.word(index) in ("and", "or", "then", "please") or said.word(index) in PREPOSITIONS:
            break
        index += 1
    return index
