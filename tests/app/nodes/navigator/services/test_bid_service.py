"""What a robot answers about the place of a search; rooms, floor and things are chosen here."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.links.network.requests import RequestRefusedError
from app.messages.control import BidRequest, SearchRequest
from app.messages.lease import Credential, LeaseRequest
from app.nodes.navigator.services import bid_service
from app.nodes.navigator.services.bid_service import BidService
from app.nodes.navigator.services.lease_service import LeaseService
from ippon.guidance.language.goals.goal import Attribute
from ippon.mission.snapshot import MissionState
from ippon.planning.floor_ways import ReachedFloor
from ippon.rooms.named_rooms import RoomName
from ippon.rooms.room_inference import NO_ROOM, Rooms
from ippon.vocabulary import MATTERPORT_40
from tests.app.memory.test_memory_file import thing
from tests.app.nodes.console.drawn_home import status_of

ANNA = Credential(session="a" * 20, name="Anna")
BEN = Credential(session="b" * 20, name="Ben")


@pytest.fixture
def robot(desk, monkeypatch):
    """A robot at (0.5, 1) in a corridor of 10 by 2 m: kitchen from 4 to 6 m, bedroom behind it."""
    part = np.zeros((50, 10), np.int32)
    part[20:30], part[30:] = 1, 2
    rooms = Rooms(
        types=("bedroom", "kitchen"),
        cell_m=0.2,
        origin=np.zeros(2, np.int64),
        part=part,
        room=np.array([NO_ROOM, 1, 0]),
        probability=np.ones((3, 2)),
    )
    asked = []
    monkeypatch.setattr(bid_service, "room_evidence", lambda *_: asked.append("rooms") or rooms)
    monkeypatch.setattr(bid_service, "infer_rooms", lambda evidence, _: evidence)
    reached = np.ones((100, 20), np.bool_)
    floor = ReachedFloor(
        is_reached=reached, origin=np.zeros(2, np.int64), cell_m=0.1, start_xy=(0.55, 1.05)
    )
    voxel_map = SimpleNamespace(labels=MATTERPORT_40, arrays=lambda: None)
    mission = SimpleNamespace(
        operator=SimpleNamespace(frame=SimpleNamespace(T_world_base=np.eye(4))),
        voxel_map=voxel_map,
        state=MissionState.EXHAUSTED,
        floor_z_m=0.0,
    )
    operations = SimpleNamespace(ask=lambda question: question(mission))
    control = LeaseService()
    service = BidService(SimpleNamespace(read=lambda *_: floor), operations, desk.goals, control)
    desk.queue.conclude("exhausted")
    desk.goals.availability.status = status_of("exhausted", frames=9, explored_m2=20.0)
    things = []
    desk.goals.things = lambda: tuple(things)

    def bid(wanted="mug", context="", who=None, **fields):
        search = SearchRequest(object=wanted, context=context, **fields)
        return service.bid(BidRequest(search=search), who)

    return SimpleNamespace(
        bid=bid, mission=mission, reached=reached, things=things, service=service,
        control=control, desk=desk, asked=asked,
    )  # fmt: skip


def test_a_room_that_was_said_and_the_way_to_it(robot):
    bid = robot.bid(context="in the kitchen")
    assert (bid.is_free, bid.ground, bid.place) == (True, "room", "kitchen")
    assert bid.way_m == pytest.approx(3.55, abs=0.15)
    assert robot.bid(context="on the table in the bedroom").way_m == pytest.approx(5.55, abs=0.15)


def test_a_room_by_the_name_that_a_person_gave_it(robot):
    robot.service.room_names = lambda: (RoomName(x_m=8.0, y_m=1.0, name="Anna's room"),)
    bid = robot.bid(context="in Anna's room")
    assert (bid.ground, bid.place) == ("room", "Anna's room")


def test_a_room_that_the_map_does_not_have(robot):
    robot.things.append(thing(1, label="mug", position_world=(1.0, 1.0, 0.5)))
    bid = robot.bid(context="in the bathroom")
    assert (bid.is_free, bid.ground, bid.place, bid.way_m) == (True, "unknown", "bathroom", None)
    assert robot.bid(context="not in the kitchen").ground == "thing", "that says no room"


def test_a_closed_door_leaves_no_way(robot):
    robot.reached[20] = False
    bid = robot.bid(context="in the bedroom")
    assert (bid.ground, bid.way_m) == ("room", None)


def test_a_remembered_thing_and_the_nearest_of_several(robot):
    robot.things += [
        thing(1, label="mug", position_world=(9.5, 1.0, 0.5)),
        thing(2, label="mug", position_world=(5.5, 1.0, 0.8)),
        thing(3, label="mug", position_world=(1.0, 1.0, 0.8), gone_ns=5),
        thing(4, label="mug", position_world=(1.0, 1.0, 0.8), probability=0.2),
    ]
    bid = robot.bid("mug")
    assert (bid.ground, bid.place, bid.room) == ("thing", "mug", "kitchen")
    assert bid.way_m == pytest.approx(4.95, abs=0.2)
    assert robot.asked == [], "rooms are inferred only where one was said"


def test_a_thing_by_its_name_and_by_its_owner(robot):
    robot.things += [
        thing(1, label="mug", position_world=(1.0, 1.0, 0.5)),
        thing(2, label="mug", position_world=(7.5, 1.0, 0.5), name="Anna's mug"),
    ]
    assert robot.bid("Anna's mug").place == "Anna's mug"
    owner = Attribute(kind="owner", value="Anna")
    bid = robot.bid("mug", attributes=[owner])
    assert (bid.place, bid.way_m) == ("Anna's mug", pytest.approx(6.95, abs=0.2))


def test_without_a_place_it_is_the_explored_floor(robot):
    bid = robot.bid("unicorn")
    assert (bid.ground, bid.way_m, bid.explored_m2) == ("area", 0.0, 20.0)
    robot.desk.goals.availability.status = status_of("starting", frames=9, explored_m2=0.0)
    assert robot.bid("unicorn").ground == "unknown"


def test_who_has_control_of_the_robot_finds_it_free(robot):
    robot.control.ask(LeaseRequest(action="request"), ANNA)
    epoch = robot.control.status().epoch
    held = robot.bid(who=BEN)
    assert (held.obstacle, held.detail) == ("held", "Anna")
    assert robot.bid().obstacle == "held"
    own = Credential(session=ANNA.session, name="Anna", epoch=epoch)
    assert robot.bid(who=own).is_free


def test_a_robot_that_is_busy_still_says_how_far_it_is(robot):
    robot.mission.state = MissionState.STOPPED
    bid = robot.bid(context="in the kitchen")
    assert (bid.obstacle, bid.place, bid.way_m is None) == ("stopped", "kitchen", False)


def test_before_the_first_frame_there_is_no_way(robot):
    robot.mission.operator.frame = None
    assert robot.bid(context="in the kitchen").way_m is None


@pytest.mark.parametrize("wanted", ["???", " "])
def test_what_is_no_object_is_refused(robot, wanted):
    with pytest.raises(RequestRefusedError, match="object"):
        robot.bid(wanted)
