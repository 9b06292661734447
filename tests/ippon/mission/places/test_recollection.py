"""A robot in a home of boxes that is asked for the same thing on two days."""

import dataclasses

import pytest

from ippon.memory.instance import Sighting
from ippon.memory.instance_memory import InstanceMemory
from ippon.mission.places.recollection import Recollection, RecollectionConfig
from ippon.mission.snapshot import MissionState

pytestmark = pytest.mark.slow

DAY_NS = 86_400_000_000_000
NOW_NS = 1_700_000_000_000_000_000
TABLE = ("table", "table", (6.6, 0.6, 0.0), (7.6, 1.4, 0.7))
SOFA = ("sofa", "sofa", (1.0, 3.2, 0.0), (2.8, 3.9, 0.5))


def hat(x, y, z):
    return ("hat", "hat", (x, y, z), (x + 0.3, y + 0.3, z + 0.25))


ON_TABLE = hat(6.8, 0.8, 0.7)
ON_SOFA = hat(1.6, 3.3, 0.5)


def live(robot, recollection, max_time_s, now_ns):
    """Search until the end; returns what was noticed to be gone."""
    gone = []
    for k, _ in enumerate(iterate(robot, max_time_s)):
        gone += recollection.step(robot.mission.search, now_ns + k * 200_000_000)
    return gone


def iterate(robot, max_time_s):
    last = []

    def remember(result):
        last.append(result)
        return False

    # One result at a time, so that memory sees each frame.
    while max_time_s > 0.0:
        robot.search(0.2, remember)
        yield last[-1]
        max_time_s -= 0.2
        if last[-1].snapshot.state in (MissionState.FOUND, MissionState.EXHAUSTED):
            return


def spend_first_day(searcher, room, x):
    """Return a robot that has found the hat on the table, and its memory."""
    robot = searcher([*room(8.0, 4.0), TABLE, SOFA, ON_TABLE], x, 1.0)
    memory = InstanceMemory()
    recollection = Recollection(robot.mission.voxel_map, memory)
    robot.ask("hat")
    assert recollection.begin(robot.mission.search) == ()
    live(robot, recollection, 90.0, NOW_NS)
    assert robot.last.state is MissionState.FOUND
    return robot, recollection


@pytest.fixture
def first_day(searcher, room):
    """A robot that has found the hat close to its start, and its memory."""
    return spend_first_day(searcher, room, 4.0)


def begin_second_day(robot, recollection, boxes):
    """Another goal in between, then the hat again, from where the robot has gone."""
    robot.ask("sofa", goal_id=2)
    recollection.begin(robot.mission.search)
    live(robot, recollection, 90.0, NOW_NS + DAY_NS // 2)
    assert robot.last.state is MissionState.FOUND
    robot.rebuild(boxes)
    robot.ask("hat", goal_id=3)
    return recollection.begin(robot.mission.search)


def test_a_find_is_remembered_with_its_place_until_it_is_rejected(first_day):
    robot, recollection = first_day
    (one,) = [k for k in recollection.memory.instances() if k.label == "hat"]
    assert one.source == "search"
    assert one.position_world == robot.last.find.position_world
    assert one.position_world == pytest.approx((6.95, 0.95, 0.85), abs=0.2)
    assert {k.label for k in recollection.memory.instances()} >= {"table", "hat"}
    # What is rejected is forgotten.
    assert robot.mission.goals.reject_find()
    recollection.step(robot.mission.search, NOW_NS + 10**11)
    assert "hat" not in {k.label for k in recollection.memory.instances()}


def test_the_next_search_goes_to_the_remembered_place_first(first_day, room):
    robot, recollection = first_day
    recalled = begin_second_day(robot, recollection, [*room(8.0, 4.0), TABLE, SOFA, ON_TABLE])
    assert [one.label for one in recalled] == ["hat"]
    driven = robot.world.path_length_m()
    assert live(robot, recollection, 60.0, NOW_NS + DAY_NS) == []
    assert robot.last.state is MissionState.FOUND
    assert robot.world.path_length_m() - driven < 7.0, "straight there"
    (one,) = [k for k in recollection.memory.instances() if k.label == "hat"]
    assert not one.is_gone
    assert one.first_seen_ns < NOW_NS + DAY_NS // 2 < NOW_NS + DAY_NS <= one.last_seen_ns


def test_a_thing_that_was_moved_is_unlearned_and_found_elsewhere(first_day, room):
    robot, recollection = first_day
    robot.rebuild([*room(8.0, 4.0), TABLE, SOFA, ON_SOFA])
    robot.ask("hat", goal_id=2)
    assert len(recollection.begin(robot.mission.search)) == 1
    gone = live(robot, recollection, 120.0, NOW_NS + DAY_NS)
    assert [one.label for one in gone] == ["hat"]
    assert gone[0].position_world == pytest.approx((6.95, 0.95, 0.85), abs=0.2)
    assert robot.last.state is MissionState.FOUND
    hats = [k for k in recollection.memory.instances() if k.label == "hat"]
    assert [one.is_gone for one in hats] == [True, False]
    assert hats[1].position_world == pytest.approx((1.75, 3.45, 0.65), abs=0.25)
    assert hats[0].last_seen_ns < NOW_NS + DAY_NS // 2 < hats[0].gone_ns


def test_a_thing_that_lay_on_the_floor_is_unlearned(searcher, room):
    robot = searcher([*room(8.0, 4.0), TABLE, SOFA, hat(6.0, 2.4, 0.0)], 1.0, 1.0)
    recollection = Recollection(robot.mission.voxel_map, InstanceMemory())
    robot.ask("hat")
    recollection.begin(robot.mission.search)
    live(robot, recollection, 90.0, NOW_NS)
    assert robot.last.state is MissionState.FOUND
    robot.rebuild([*room(8.0, 4.0), TABLE, SOFA, ON_SOFA])
    robot.ask("hat", goal_id=2)
    assert len(recollection.begin(robot.mission.search)) == 1
    gone = live(robot, recollection, 120.0, NOW_NS + DAY_NS)
    assert [one.label for one in gone] == ["hat"]
    assert robot.last.state is MissionState.FOUND
    assert len(robot.last.candidates) == 1, "nothing of the remembered place is left"


def test_moved_furniture_is_unlearned(searcher, room):
    # On its way it sees the sofa from the side that it will look at the next day.
    robot, recollection = spend_first_day(searcher, room, 1.0)
    moved = ("sofa", "sofa", (5.0, 3.2, 0.0), (6.8, 3.9, 0.5))
    begin_second_day(robot, recollection, [*room(8.0, 4.0), TABLE, moved, ON_TABLE])
    robot.ask("sofa", goal_id=4)
    assert recollection.begin(robot.mission.search) == (), "the map knows where sofas are"
    gone = live(robot, recollection, 90.0, NOW_NS + DAY_NS)
    recollection.update(NOW_NS + 2 * DAY_NS)
    sofas = [k for k in recollection.memory.instances() if k.label == "sofa"]
    assert [(k.is_gone, k.position_world[0]) for k in sofas] == [
        (True, pytest.approx(1.9, abs=0.4)),
        (False, pytest.approx(5.9, abs=0.4)),
    ]
    assert [k.instance_id for k in gone] == [sofas[0].instance_id]


def test_one_of_several_that_is_rejected_is_forgotten_and_the_other_kept(first_day):
    robot, recollection = first_day
    search = robot.mission.search
    search.goal = dataclasses.replace(search.goal, count=2)
    elsewhere = dataclasses.replace(search.find, position_world=(5.0, 3.0, 0.5), number=0)
    robot.mission.goals.count_again(search.goal.goal_id, [elsewhere])
    recollection.step(search, NOW_NS + 10**11)
    assert hats(recollection) == 2
    assert robot.mission.goals.reject_find(number=search.counted[0].number)
    recollection.step(search, NOW_NS + 2 * 10**11)
    assert hats(recollection) == 1


def hats(recollection):
    return sum(one.label == "hat" for one in recollection.memory.instances())


@pytest.mark.parametrize(("low", "high"), [(0.3, 0.2), (0.0, 0.9), (0.3, 1.0)])
def test_probabilities_that_mean_nothing_are_refused(low, high):
    with pytest.raises(ValueError, match="disproved_probability lies above 0"):
        RecollectionConfig(disproved_probability=low, recalled_probability=high)


def test_what_a_person_denied_is_not_found_again_but_another_one_is(first_day, room):
    robot, recollection = first_day
    (one,) = [k for k in recollection.memory.instances() if k.label == "hat"]
    recollection.memory.note(one.instance_id, name="", denied=("hat",))
    boxes = [*room(8.0, 4.0), TABLE, SOFA, ON_TABLE, ON_SOFA]
    assert begin_second_day(robot, recollection, boxes) == (), "it is not looked at first"
    live(robot, recollection, 90.0, NOW_NS + DAY_NS)
    assert robot.last.state is MissionState.FOUND
    assert robot.last.find.position_world == pytest.approx((1.75, 3.45, 0.65), abs=0.3)


def test_a_named_thing_is_searched_for_and_not_another_of_its_kind(first_day, room):
    robot, recollection = first_day
    (one,) = [k for k in recollection.memory.instances() if k.label == "hat"]
    memory = recollection.memory
    other = dataclasses.replace(_seen_as(one), position_world=(1.75, 3.45, 0.65))
    other = memory.note_find(other, NOW_NS + 1)
    memory.note(other.instance_id, name="Anna's hat", denied=())
    robot.ask("sofa", goal_id=2)
    recollection.begin(robot.mission.search)
    live(robot, recollection, 90.0, NOW_NS + DAY_NS // 2)
    robot.rebuild([*room(8.0, 4.0), TABLE, SOFA, ON_TABLE, ON_SOFA])
    robot.ask("hat", goal_id=3)
    search = robot.mission.search
    search.goal = dataclasses.replace(search.goal, thing_id=other.instance_id)
    assert [k.name for k in recollection.begin(search)] == ["Anna's hat"]
    live(robot, recollection, 90.0, NOW_NS + DAY_NS)
    assert robot.last.state is MissionState.FOUND
    assert robot.last.find.position_world == pytest.approx((1.75, 3.45, 0.65), abs=0.3)


def _seen_as(one):
    names = [field.name for field in dataclasses.fields(Sighting)]
    return Sighting(**{name: getattr(one, name) for name in names})
