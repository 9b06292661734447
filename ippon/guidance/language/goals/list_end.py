"""What is settled once a list of objects has been read: its parts, its destination, its place."""

from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.goals.goal import Relation
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.mentions import room_phrases


def _replace_by_parts(reading: Reading) -> None:
    """Read "two markers, one red and one black" as the two."""
    listed = reading.drafts[reading.list_start :]
    if len(listed) < 3 or not isinstance(listed[0].count, int) or listed[0].attributes:
        return
    parts = listed[1:]
    same = all(not one.phrase.head and isinstance(one.count, int) for one in parts)
    kinds = listed[0].phrase.count is None and listed[0].display.endswith("s")
    kinds = kinds and all(one.phrase.count is not None and one.attributes for one in parts)
    if same and (kinds or sum(int(one.count) for one in parts) == listed[0].count):
        reading.drafts.remove(listed[0])


def _drop_destination(reading: Reading) -> None:
    """Take "bring the bucket upstairs" to say where it shall go, which is not done."""
    for one in reading.drafts[reading.list_start :]:
        if not one.trigger.lower().startswith(("bring", "take", "carry")):
            continue
        going = [said for said in one.attributes if said.value.startswith("to ")]
        reading.unused += [said.value for said in going]
        one.attributes = [said for said in one.attributes if said not in going]
        for place in one.relations:
            if place.place in ("upstairs", "downstairs") and one.context == [place.place]:
                one.relations, one.context = [], []
                reading.unused.append(place.place)
                break


def _is_in_room(place: Relation) -> bool:
    return is_room(place.place) or bool(room_phrases(place.place))


def settle(reading: Reading) -> None:
    """Settle what the end of a list says of all its objects."""
    _replace_by_parts(reading)
    _drop_destination(reading)
    _share_place(reading)


def _share_place(reading: Reading) -> None:
    """Let the objects of one list share the place that is said at its end."""
    listed = reading.drafts[reading.list_start :]
    if len(listed) < 2 or any(one.order == "then" for one in listed[1:]):
        return
    last = listed[-1]
    if any(one.relations for one in listed[:-1]):
        return
    stated = reading.said.word(last.phrase.end) in ("are", "were", "aren't")
    together = last.phrase.shared or last.trigger == "told" or (stated and last.trigger == "bare")
    shared = [
        place for place in last.relations
        if place not in reading.places
        and (together or _is_in_room(place) or place.relation == "from")
    ]  # fmt: skip
    if not shared:
        return
    for one in listed[:-1]:
        for place in shared:
            one.relate(place)
        for words in last.context:
            one.note(words)
