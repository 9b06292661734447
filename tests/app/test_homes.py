from importlib.metadata import EntryPoint

import pytest

from app.errors import UsageError
from app.homes import expand_homes, load_home
from ippon import extensions


def test_ranges_of_homes_hold_their_last(room):
    assert expand_homes(["1001:1003", "7,9", str(room), "7"]) == (
        "1001", "1002", "1003", "7", "9", str(room),
    )  # fmt: skip
    assert expand_homes(["floor:2:3,floor:9"]) == ("floor:2", "floor:3", "floor:9")
    assert expand_homes(["7", "007", "007:008", "floor:01"]) == ("7", "8", "floor:1")


def test_a_home_that_is_written_in_two_ways_is_searched_once(room):
    assert expand_homes([str(room), f"{room}/", f"{room}/../room"]) == (str(room),)


def test_commas_in_the_text_for_a_source_are_of_that_text(monkeypatch):
    point = EntryPoint("rooms", "no_such_module:LOAD", extensions.SCENES)
    monkeypatch.setattr(extensions, "entry_points", lambda **_: [point])
    assert expand_homes(["rooms:6,4", "1:2,rooms:7,", "3,4"]) == (
        "rooms:6,4", "1", "2", "rooms:7,", "3", "4",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("homes", "text"),
    [
        (["5:3"], "from a smaller seed to a larger one"),
        (["1:9999999"], "from a smaller seed to a larger one"),
        (["nowhere"], "no home 'nowhere'"),
        ([","], "no homes"),
        (["3:x"], "no home '3:x'"),
        (["3:²"], "no home '3:²'"),
        (["floor:5:3"], "from a smaller seed to a larger one"),
        (["floor:"], "no home 'floor:'.*floor:SEED"),
        (["studio:6"], "no home .studio:6.*another package adds .none is installed"),
    ],
)
def test_homes_that_are_none(homes, text):
    with pytest.raises(UsageError, match=text):
        expand_homes(homes)


def test_a_home_has_three_mugs_more_where_they_are_asked_for():
    few, more = (
        sum(one.label == "mug" for one in load_home("5", coloured_mugs=coloured).instances)
        for coloured in (False, True)
    )
    assert more >= 3
    assert more > few
