"""A mug that is remembered on a wall ahead: what the search for one does with its place."""

import dataclasses

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.config import MapConfig
from ippon.memory.instance import Sighting
from ippon.memory.instance_memory import InstanceMemory
from ippon.mission.config import MissionConfig
from ippon.mission.finds.rejection import exclude_only, readmit_most_likely, set_aside
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.places.recollection import Recollection
from ippon.mission.snapshot import Find, MissionState
from ippon.robot import ZED
from ippon.vocabulary import MATTERPORT_40

SECOND_NS = 1_000_000_000
DAY_NS = 86_400 * SECOND_NS
ON_WALL = (2.0, 0.0, 1.0)
BESIDE = (2.0, 0.4, 1.0)
"""Another mug there is not the same one, though memory takes a moved one for the same."""


def wall(depth_m=2.0, columns=64):
    """Return an image of a wall, with depth in its first columns."""
    depth = np.zeros((48, 64), np.float32)
    depth[:, :columns] = depth_m
    return Frame(
        stamp_ns=0,
        color=np.full((48, 64, 3), 90, np.uint8),
        depth=depth,
        camera=PinholeCamera.from_horizontal_fov(64, 48, 1.2),
        T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)),
        T_world_base=make_transform(np.eye(3), (0.0, 0.0, 0.0)),
        tilt_rad=0.0,
    )


def find(at=ON_WALL, number=0):
    return Find(
        position_world=at, size_m=(0.1, 0.1, 0.1), probability=0.95, voxels=3, box_px=None,
        number=number,
    )  # fmt: skip


def sighting(at=ON_WALL):
    return Sighting(label="mug", probability=0.95, position_world=at, size_m=(0.1,) * 3, voxels=3)


class Home:
    """A mission that has seen the wall, and its memory."""

    def __init__(self):
        config = MissionConfig(map=MapConfig(voxel_size_m=0.1, memory_limit_mb=128.0))
        self.mission = Mission(config, ZED, MATTERPORT_40, seed=0)
        self.map = self.mission.voxel_map
        self.map.integrate(wall())
        self.memory = InstanceMemory()
        self.recollection = Recollection(self.map, self.memory)
        self.now_ns = DAY_NS

    @property
    def search(self):
        return self.mission.search

    def remember(self, at=ON_WALL):
        return self.memory.note_find(sighting(at), SECOND_NS).instance_id

    def ask(self, **said):
        """Set a goal for a mug; returns the things that are recalled."""
        resolved = resolve_object("mug", MATTERPORT_40)
        goal = dataclasses.replace(Goal.of(resolved, 1), **said)
        self.mission.goals.set_goal(goal, EmbeddedPrior().levels(resolved, "", MATTERPORT_40))
        return [one.instance_id for one in self.recollection.begin(self.search)]

    def announce(self, found):
        """End the search with a find."""
        self.search.announce(found)
        self.search.state = MissionState.FOUND

    def step(self):
        """Learn from a step; returns the things that are said to be gone."""
        self.now_ns += 2 * SECOND_NS
        return [one.instance_id for one in self.recollection.step(self.search, self.now_ns)]

    def drop(self):
        """Have the map give up everything, as its oldest parts at its bound."""
        rows = np.flatnonzero(self.map._pools.used)
        self.map._integrator._blocks.forget(self.map._layers, rows)

    def places(self):
        return [one.position_world for one in self.memory.instances()]

    def is_gone(self, number):
        return self.memory.get(number).is_gone


@pytest.fixture
def home():
    return Home()


def test_images_that_do_not_show_a_recalled_thing_say_that_it_is_gone(home):
    mug = home.remember()
    assert home.ask() == [mug]
    assert home.step() == []
    home.map.integrate(wall(4.0))
    for _ in range(20):
        home.map.integrate(wall(4.0))
    assert home.step() == [mug]
    assert home.is_gone(mug)


def test_a_recalled_thing_that_is_set_aside_is_not_gone_and_waits_to_be_looked_at_again(home):
    mug = home.remember()
    home.ask()
    home.step()
    set_aside(home.search, home.map, find())
    assert home.step() == []
    assert not home.is_gone(mug)
    assert readmit_most_likely(home.search, home.map)
    for _ in range(20):
        home.map.integrate(wall(4.0))
    assert home.step() == [mug], "images may still say that it is gone"


@pytest.mark.parametrize("moved_m", [0.0, 0.3])
def test_a_recalled_thing_that_is_counted_is_not_gone(home, moved_m):
    mug = home.remember()
    assert home.ask(count=2) == [mug]
    home.step()
    home.mission.goals.count_again(1, [find((2.0, moved_m, 1.0))])
    assert home.step() == []
    assert not home.is_gone(mug)
    assert home.memory.get(mug).last_seen_ns == home.now_ns


def test_what_was_found_before_another_one_is_wanted_is_neither_recalled_nor_gone(home):
    mug = home.remember()
    home.ask()
    home.announce(find())
    home.step()
    assert home.ask(other=True) == []
    assert home.step() == []
    assert not home.is_gone(mug)


def test_a_recalled_thing_of_which_somebody_says_that_it_is_none_is_not_gone(home):
    mug = home.remember()
    home.ask()
    home.step()
    exclude_only(home.search, home.map, find())
    assert home.step() == []
    assert not home.is_gone(mug)


def test_what_an_earlier_run_has_counted_is_not_recalled(home):
    mug = home.remember()
    resolved = resolve_object("mug", MATTERPORT_40)
    goal = dataclasses.replace(Goal.of(resolved, 1), count=2)
    home.mission.goals.set_goal(goal, EmbeddedPrior().levels(resolved, "", MATTERPORT_40))
    home.mission.goals.count_again(1, [find()])
    assert home.recollection.begin(home.search) == ()
    assert home.step() == []
    assert not home.is_gone(mug)


def test_a_recalled_find_that_is_rejected_is_not_said_to_be_gone(home):
    home.remember()
    home.ask()
    home.announce(find())
    home.step()
    assert home.mission.goals.reject_find()
    assert home.step() == []


def test_two_finds_close_together_are_two_things_and_one_that_is_rejected_leaves_the_other(home):
    home.ask(count=3)
    home.mission.goals.count_again(1, [find(), find(BESIDE)])
    home.step()
    assert home.places() == [ON_WALL, BESIDE]
    assert home.mission.goals.reject_find(number=1)
    home.step()
    assert home.places() == [BESIDE]


def test_a_recalled_place_that_the_map_has_given_up_is_not_gone_and_begins_anew(home):
    mug = home.remember()
    home.ask()
    home.step()
    home.drop()
    assert home.step() == []
    assert not home.is_gone(mug)
    home.map.integrate(wall())
    assert home.step() == [], "no image has said anything yet"
    assert home.map.best_ooi() == pytest.approx(0.9, abs=0.01), "the robot goes there first"
    home.drop()
    for _ in range(20):
        home.map.integrate(wall(4.0))
    assert home.step() == [mug], "the map sees again that nothing is there"


def test_a_place_that_the_map_had_given_up_before_the_search_is_not_gone(home):
    mug = home.remember()
    home.drop()
    assert home.ask() == [mug]
    assert home.step() == []
    assert not home.is_gone(mug)


@pytest.fixture
def wide(home):
    """A thing of 2 m along the wall that the map has given up; it sees 0.3 m of it again."""
    wide = dataclasses.replace(sighting(), size_m=(0.1, 2.0, 0.1))
    number = home.memory.note_find(wide, SECOND_NS).instance_id
    assert home.ask() == [number]
    home.step()
    home.drop()
    home.map.integrate(wall(columns=16))
    assert home.step() == []
    assert home.map.best_ooi() == pytest.approx(0.9, abs=0.01)
    return number


def test_a_place_that_the_map_sees_in_part_again_is_not_judged_by_that_part(home, wide):
    for _ in range(20):
        home.map.integrate(wall(4.0, columns=16))
    assert home.step() == home.step() == []
    for _ in range(20):
        home.map.integrate(wall(4.0))
    assert home.step() == [wide]


def test_what_was_recalled_twice_is_withdrawn(home, wide):
    home.map.integrate(wall())
    home.step()
    assert home.map.best_ooi() == pytest.approx(0.9, abs=0.01)
    home.memory.remove(wide)
    home.step()
    assert home.map.best_ooi() < 0.5


@pytest.fixture
def see(monkeypatch):
    """Have images confirm the candidates of a search; they show them where `shows` says so."""

    def look(search, *candidates, shows=True):
        check = search.image_check
        check.images += 1
        shown = check.images if shows else check.images - 1
        monkeypatch.setattr(check, "last_image_of", lambda _: shown)
        monkeypatch.setattr(check, "confirms", lambda _: True)
        search.candidates = candidates

    return look


def test_a_candidate_beside_a_counted_find_is_another_thing(home, see):
    home.ask(count=3)
    home.mission.goals.count_again(1, [find()])
    home.step()
    for _ in range(2):
        see(home.search, find(BESIDE))
        home.step()
    assert home.places() == [ON_WALL, BESIDE]
    home.announce(find(BESIDE))
    home.step()
    assert home.places() == [ON_WALL, BESIDE]


def test_what_an_earlier_search_found_is_the_thing_that_a_tour_sees_again(home, see):
    mug = home.remember()
    home.ask(goal_id=2)
    tour = home.search
    home.ask(goal_id=3)
    home.announce(find())
    home.step()
    # The recollection did not begin this one, as those of a tour.
    for seconds in (2, 4):
        see(tour, find())
        home.recollection.step(tour, home.now_ns + seconds * SECOND_NS)
    (one,) = home.memory.instances()
    assert (one.instance_id, one.last_seen_ns) == (mug, home.now_ns + 4 * SECOND_NS)


def test_a_find_was_last_seen_when_an_image_showed_it_last(home, see):
    home.ask()
    home.announce(find())
    home.step()
    see(home.search, find())
    home.step()
    seen_ns = home.now_ns
    for _ in range(3):
        # The robot has turned away: the map alone shows it.
        see(home.search, find(), shows=False)
        home.step()
    (one,) = home.memory.instances()
    assert one.last_seen_ns == seen_ns


@pytest.mark.parametrize(
    "said", [{"name": "Anna's mug", "denied": ()}, {"name": "", "denied": ("cup",)}]
)
def test_a_rejected_find_of_which_people_have_said_something_is_kept(home, said):
    mug = home.remember()
    home.memory.note(mug, **said)
    home.ask()
    home.announce(find())
    home.step()
    assert home.mission.goals.reject_find()
    home.step()
    assert [one.instance_id for one in home.memory.instances()] == [mug]


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ({}, False),
        ({"attributes": (Attribute(kind="colour", value="red"),)}, True),
        ({"context": "on the table"}, True),
        ({"other": True}, True),
        ({"thing_id": 99}, True),
    ],
)
def test_what_is_rejected_is_forgotten_unless_it_may_be_another_than_was_asked_for(
    home, said, kept
):
    home.remember()
    home.ask(**said)
    home.announce(find())
    home.step()
    assert home.mission.goals.reject_find()
    home.step()
    assert home.places() == ([ON_WALL] if kept else [])


def test_what_only_this_search_has_found_is_forgotten_when_it_is_rejected(home):
    home.ask(attributes=(Attribute(kind="colour", value="red"),))
    home.announce(find())
    home.step()
    assert home.places() == [ON_WALL]
    assert home.mission.goals.reject_find()
    home.step()
    assert home.places() == []


def test_what_a_tour_finds_is_remembered_until_it_is_rejected(home):
    goals = []
    for number, name in ((1, "mug"), (2, "hat")):
        resolved = resolve_object(name, MATTERPORT_40)
        goals.append(
            (Goal.of(resolved, number), EmbeddedPrior().levels(resolved, "", MATTERPORT_40))
        )
    home.mission.goals.set_goals(goals)
    mug, hat = home.mission.goals.running
    home.recollection.follow((mug, hat))
    hat.announce(find())
    hat.state = MissionState.FOUND
    home.mission.goals.tour.settle()
    assert home.step() == []
    assert home.mission.search is mug, "another one leads"
    assert [(one.label, one.probability) for one in home.memory.instances()] == [("hat", 0.95)]
    assert home.mission.goals.reject_find(2)
    assert home.step() == []
    assert home.places() == []
