import pytest

from app.demo.contents import holds, said_contents
from app.homes import load_home


@pytest.fixture(scope="module")
def home():
    return load_home("24")


@pytest.mark.parametrize(
    ("wanted", "held"),
    [("hat", True), ("red hat", True), ("couch", True), ("bicycle", False), ("zyzzyva", False)],
)
def test_what_is_searched_for_is_there_or_not(home, wanted, held):
    assert holds(home, wanted) is held


def test_single_things_come_first_and_nothing_of_the_building(home):
    text = said_contents(home)
    assert text.startswith("in this home: apple, armchair, ")
    names = text.removeprefix("in this home: ").split(", ")
    assert "hat" in names
    assert not {"wall", "floor", "ceiling"} & set(names)


def test_of_many_things_some_are_named():
    assert said_contents(load_home("floor:0")).endswith(" more")
