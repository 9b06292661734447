"""The picture beside a find is of that find."""

import pytest
from msgspec.structs import replace

from app.messages.status import GoalStatus
from app.nodes.console.panels import find_pictures
from app.nodes.console.panels.find_pictures import FindPictures


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    """Leave out the frame around the object."""
    monkeypatch.setattr(find_pictures, "outlined", lambda encoded, _: encoded)


def status_at(stage, elapsed_s):
    """Return the status of a tour in which goal 1 was found after 20 s."""
    found = GoalStatus(goal_id=1, object="tv", outcome="found", took_s=20.0, tour=1)
    lead = GoalStatus(goal_id=2, object="chair", outcome="active", tour=1)
    return stage.status_of(goal=lead, tour=[found, lead], elapsed_s=elapsed_s)


def test_an_earlier_find_of_a_tour_keeps_its_own_picture(stage):
    pictures, first = FindPictures(), stage.find_of()
    second = replace(first, goal_id=2, position_world=(1.0, 2.0, 0.5))
    assert pictures.picture_of(first, status_at(stage, 20.2), b"tv") == b"tv"
    assert pictures.picture_of(second, status_at(stage, 54.0), b"chair") == b"chair"
    assert pictures.picture_of(first, status_at(stage, 54.0), b"chair") == b"tv"


def test_a_find_that_the_search_went_on_from_is_not_shown_in_the_present_image(stage):
    assert FindPictures().picture_of(stage.find_of(), status_at(stage, 54.0), b"chair") is None


def test_only_the_latest_pictures_are_kept(stage):
    pictures, find = FindPictures(), stage.find_of()
    for number in range(find_pictures._KEPT + 2):
        pictures.picture_of(replace(find, number=number), status_at(stage, 20.0), b"old")
    again = pictures.picture_of(replace(find, number=0), status_at(stage, 20.0), b"new")
    assert again == b"new"
