"""What is not meant, and rooms to go to: they say more about the object that follows."""

from dataclasses import replace

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.clauses import decline_place
from ippon.guidance.language.goals.drafts import Reading, draft
from ippon.guidance.language.goals.goal import Attribute, Relation
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.grammar.relation_phrase import relation_to
from ippon.guidance.language.lists.goal_list import read_goals, read_modifiers
from ippon.guidance.language.naming import same_object


def not_this(reading: Reading, index: int) -> int:
    """Read "not the red mug but the blue one"."""
    said = reading.said
    phrase = read_noun_phrase(said, index + 1)
    if phrase is None or reading.drafts:
        return index
    while said.word(phrase.end) in ("nor", "or"):
        more = read_noun_phrase(said, phrase.end + 1)
        if more is None or not (phrase.attributes and more.attributes):
            break
        named = replace(more, head=more.head or phrase.head)
        phrase = replace(named, attributes=(*phrase.attributes, *more.attributes))
    if is_room(phrase.head) and said.breaks(phrase.end):
        decline_place(reading, relation_to(said, index + 1, phrase, "in", negated=True))
        return phrase.end
    at = phrase.end + (said.word(phrase.end) in ("but", "just", "only"))
    at = said.corrected(at, phrases.CORRECTIONS)
    other = read_noun_phrase(said, at)
    if other is None:
        return index
    beside = at == phrase.end and not said.breaks(at)  # "Not the hammer the mallet".
    if beside and not (other.known and other.determined and said.breaks(other.end)):
        return index
    again = bool(phrase.attributes and other.attributes) and same_object(phrase.head, other.head)
    if not other.head or again:
        goal = draft(replace(phrase, attributes=()), "and", "bare")
        first, _, last = phrase.head.rpartition(" ")
        if first and not phrase.attributes and load_knowledge().find(last) is not None:
            goal.head = last  # "Not the kitchen scissors, the small ones".
            goal.add(Attribute(kind="other", value=first, negated=True))
        for one in phrase.attributes:
            goal.add(replace(one, negated=True))
        for one in other.attributes:
            goal.add(one)
        goal.display = " ".join([*(one.value for one in other.attributes), goal.head])
        reading.drafts.append(goal)
        return read_modifiers(reading, other.end)
    return read_goals(reading, at, "bare")


def drop_rooms(reading: Reading) -> None:
    """Take a room to go to as the place of the object that follows it, or is searched for there."""
    for number, room in enumerate(reading.drafts[1:], start=1):
        if reading.places and is_room(room.head) and room.trigger not in phrases.OTHER_TASKS:
            goal = reading.drafts[number - 1]
            goal.relate(Relation(relation="in", place=room.head))
            goal.note(f"then in the {room.head}")
            reading.drafts.remove(room)
            return  # "Check the van for my gloves, then the shed".
    for number, room in enumerate(reading.drafts[:-1]):
        goal = reading.drafts[number + 1]
        going = room.trigger.lower().startswith(("go", "drive", "walk", "navigate", "head", "move"))
        if going and is_room(room.head) and not is_room(goal.head):
            for one in reading.drafts[number + 1 :]:
                if one.order == "and":
                    one.relate(Relation(relation="in", place=room.head))
                    one.note(f"in the {room.head}")
            goal.order = room.order
            reading.drafts.remove(room)
            return
