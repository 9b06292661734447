import pytest

from app.messages.memory import Room
from app.view.plan.plan_scene import PlanScene, PlanThing
from app.view.plan.sheet import placed_texts, scale_bar_m
from app.view.words import ENGLISH, Words


@pytest.mark.parametrize(("width_m", "bar_m"), [(9.2, 1.0), (12.0, 2.0), (40.0, 5.0), (0.1, 0.1)])
def test_a_scale_bar_is_a_round_length(width_m, bar_m):
    assert scale_bar_m(width_m) == pytest.approx(bar_m)


def _thing(text, x_m, y_m):
    return PlanThing(text=text, x_m=x_m, y_m=y_m, size_x_m=1.0, size_y_m=1.0)


def test_names_that_would_meet_another_are_left_out_and_rooms_come_first():
    room = Room(x_m=1.0, y_m=1.0, area_m2=9.0, kind="kitchen", name="")
    things = [_thing("sink", 1.1, 1.0), _thing("oven", 3.0, 1.0), _thing("stove", 3.1, 1.05)]
    placed = placed_texts(PlanScene(revision=1, rooms=[room], things=things), ENGLISH)
    assert [one.text for one in placed] == ["kitchen", "oven"]
    placed = placed_texts(PlanScene(revision=1, rooms=[room], things=things), Words("de"))
    assert [one.text for one in placed] == ["Küche", "Backofen"]


def test_a_given_name_replaces_the_type():
    rooms = [
        Room(x_m=1.0, y_m=1.0, area_m2=9.0, kind="kitchen", name="Anna's"),
        Room(x_m=9.0, y_m=1.0, area_m2=9.0, kind="", name=""),
    ]
    placed = placed_texts(PlanScene(revision=1, rooms=rooms), ENGLISH)
    assert [one.text for one in placed] == ["Anna's"]
