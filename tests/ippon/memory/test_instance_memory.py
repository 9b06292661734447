import pytest

from ippon.memory.config import MemoryConfig
from ippon.memory.instance import Sighting
from ippon.memory.instance_memory import InstanceMemory
from ippon.memory.map_clusters import MapClusters, share_observed

MINUTE_NS = 60_000_000_000
CHAIR = ((2, 2, 0), (6, 6, 5))


@pytest.fixture
def watched(painted_map):
    """A map, its memory, and a function that takes the map in."""
    memory, clusters = InstanceMemory(), MapClusters(painted_map)

    def look(now_ns):
        return memory.update(
            clusters.update(), now_ns, lambda one: share_observed(painted_map, one)
        )

    return painted_map, memory, look


def find(label="hat", at=(1.0, 1.0, 0.5), p=0.95):
    return Sighting(label=label, probability=p, position_world=at, size_m=(0.2, 0.2, 0.2), voxels=3)


def test_a_thing_keeps_its_identity_while_it_comes_into_view(watched):
    painted, memory, look = watched
    painted.paint((2, 2, 0), (4, 6, 5), "chair")
    look(MINUTE_NS)
    painted.paint(*CHAIR, "chair")
    look(2 * MINUTE_NS)
    (chair,) = memory.instances()
    assert (chair.voxels, chair.first_seen_ns, chair.last_seen_ns) == (
        80,
        MINUTE_NS,
        2 * MINUTE_NS,
    )
    painted.look_at((2, 2, 0))
    look(3 * MINUTE_NS)
    assert memory.instances()[0].last_seen_ns == 3 * MINUTE_NS


def test_another_label_in_its_place_is_a_correction(watched):
    painted, memory, look = watched
    painted.paint(*CHAIR, "chair")
    look(MINUTE_NS)
    painted.paint(*CHAIR, "stool")
    assert look(20 * MINUTE_NS) == ()
    (stool,) = memory.instances()
    assert (stool.label, stool.first_seen_ns, stool.is_gone) == ("stool", MINUTE_NS, False)


def test_what_was_moved_is_gone_and_new_elsewhere(watched):
    painted, memory, look = watched
    painted.paint(*CHAIR, "chair")
    look(MINUTE_NS)
    painted.paint(*CHAIR)
    painted.paint((20, 20, 0), (24, 24, 5), "chair")
    (gone,) = look(30 * MINUTE_NS)
    assert (gone.last_seen_ns, gone.gone_ns) == (MINUTE_NS, 30 * MINUTE_NS)
    assert [one.is_gone for one in memory.instances()] == [True, False]
    painted.paint(*CHAIR, "chair")
    assert look(40 * MINUTE_NS) == ()
    assert [one.is_gone for one in memory.instances()] == [False, False], "it was put back"


def test_a_thing_that_vanishes_bit_by_bit_keeps_its_box_until_it_is_gone(watched):
    painted, memory, look = watched
    painted.paint(*CHAIR, "chair")
    look(100 * MINUTE_NS)
    before = memory.instances()[0]
    for k in range(2, 6):
        painted.paint((k, 2, 0), (k + 1, 6, 5))
        gone = look(100 * MINUTE_NS + (k - 1) * 5_000_000_000)
        shown = memory.instances()
        assert len(shown) <= 1
        assert all(one.size_m == before.size_m for one in shown)
    assert gone == (), "it vanished within a minute of its first sight: it was never there"
    assert memory.instances() == ()


def test_what_the_map_gives_up_is_not_gone(watched):
    painted, memory, look = watched
    painted.paint(*CHAIR, "chair")
    look(MINUTE_NS)
    painted.drop((2, 2, 0))
    assert look(90 * MINUTE_NS) == ()
    (chair,) = memory.instances()
    assert not chair.is_gone


def test_memory_of_another_day_is_joined_to_the_map(watched):
    painted, memory, look = watched
    painted.paint(*CHAIR, "chair")
    painted.paint((20, 20, 0), (24, 24, 5), "stool")
    look(MINUTE_NS)
    kept = memory.instances()
    painted.paint((20, 20, 0), (24, 24, 5))
    later = InstanceMemory(instances=kept)
    observed = lambda one: share_observed(painted, one)  # noqa: E731
    gone = later.update(MapClusters(painted).update(), 1440 * MINUTE_NS, observed)
    assert [one.label for one in gone] == ["stool"]
    assert [one.instance_id for one in later.instances()] == [k.instance_id for k in kept]
    changes = later.take_changes()
    assert set(changes.changed) == {k.instance_id for k in kept}
    assert later.take_changes().changed == {}


def test_a_find_near_an_earlier_one_is_the_same_thing():
    memory = InstanceMemory()
    first = memory.note_find(find(), MINUTE_NS)
    again = memory.note_find(find(at=(1.2, 1.1, 0.5)), 2 * MINUTE_NS)
    other = memory.note_find(find(at=(3.0, 1.0, 0.5)), 3 * MINUTE_NS)
    assert again.instance_id == first.instance_id != other.instance_id
    assert again.first_seen_ns == MINUTE_NS
    memory.mark_gone(first.instance_id, 4 * MINUTE_NS)
    assert memory.mark_gone(first.instance_id, 5 * MINUTE_NS) is None
    assert memory.get(first.instance_id).gone_ns == 4 * MINUTE_NS
    assert not memory.note_find(find(), 6 * MINUTE_NS).is_gone, "it was put back"


def test_a_find_beside_what_is_none_as_a_person_said_is_another_thing():
    memory = InstanceMemory()
    denied = memory.note_find(find("mug"), MINUTE_NS)
    denied = memory.note(denied.instance_id, name="", denied=("mug",))
    mug = memory.note_find(find("mug", (1.45, 1.0, 0.5)), 2 * MINUTE_NS)
    assert (mug.denied, mug.believed) == ((), "mug")
    assert memory.instances() == (denied, mug)


def test_what_never_was_is_forgotten_and_removed_from_files():
    memory = InstanceMemory()
    one = memory.note_find(find(), MINUTE_NS)
    memory.take_changes()
    memory.remove(one.instance_id)
    memory.remove(one.instance_id)
    assert memory.instances() == ()
    assert memory.take_changes().removed == {one.instance_id}


def test_rooms_and_pictures_are_noted():
    memory = InstanceMemory()
    one = memory.note_find(find(), MINUTE_NS)
    memory.set_rooms(lambda _: "kitchen", 0.0)
    memory.set_rooms(lambda _: "", 0.0)
    memory.set_view_score(one.instance_id, 0.2)
    memory.set_view_score(99, 0.2)
    (known,) = memory.instances()
    assert (known.room, known.view_score) == ("kitchen", 0.2)


def test_a_room_that_gets_a_name_names_what_is_gone_from_it_too():
    memory = InstanceMemory()
    one = memory.note_find(find(), MINUTE_NS)
    memory.set_rooms(lambda _: "bedroom", 0.0)
    memory.mark_gone(one.instance_id, 2 * MINUTE_NS)
    memory.set_rooms(lambda _: "Anna's room", 0.0)
    assert memory.instances()[0].room == "Anna's room"


def test_rooms_of_one_floor_do_not_name_things_of_another():
    memory = InstanceMemory()
    for z in (0.5, 3.5):
        memory.note_find(find(at=(1.0, 1.0, z)), MINUTE_NS)
    memory.set_rooms(lambda _: "kitchen", 0.0)
    memory.set_rooms(lambda _: "bedroom", 3.0)
    assert [one.room for one in memory.instances()] == ["kitchen", "bedroom"]


@pytest.mark.parametrize("was_set_back", [False, True])
def test_a_clock_that_is_set_back_does_not_make_old_things_new(watched, was_set_back):
    painted, memory, look = watched
    painted.paint(*CHAIR, "chair")
    look(1000 * MINUTE_NS)
    now_ns = (10 if was_set_back else 1010) * MINUTE_NS
    painted.look_at((2, 2, 0))
    look(now_ns)
    assert memory.instances()[0].last_seen_ns == now_ns
    painted.paint(*CHAIR)
    (gone,) = look(now_ns + 1)
    assert (gone.label, gone.gone_ns) == ("chair", now_ns + 1)


def test_a_full_memory_gives_up_what_is_gone_and_then_what_is_oldest():
    memory = InstanceMemory(MemoryConfig(max_instances=3))
    ones = [memory.note_find(find(at=(2.0 * k, 0.0, 0.0)), k + 1) for k in range(3)]
    memory.mark_gone(ones[2].instance_id, 10)
    memory.note_find(find(at=(20.0, 0.0, 0.0)), 11)
    assert [one.position_world[0] for one in memory.instances()] == [0.0, 2.0, 20.0]
    memory.note_find(find(at=(30.0, 0.0, 0.0)), 12)
    assert [one.position_world[0] for one in memory.instances()] == [2.0, 20.0, 30.0]
    assert len(memory) == 3


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"same_overlap": 0.0}, "same_overlap lies in"),
        ({"gone_share": 1.5}, "gone_share lies in"),
        ({"max_instances": 0}, "max_instances is at least 1"),
    ],
)
def test_nonsense_is_refused(fields, text):
    with pytest.raises(ValueError, match=text):
        MemoryConfig(**fields)


def test_what_a_person_says_of_a_thing_stays_when_it_is_seen_again_or_grows_into_another(watched):
    painted, memory, look = watched
    painted.paint(*CHAIR, "chair")
    look(MINUTE_NS)
    (chair,) = memory.instances()
    memory.note(chair.instance_id, name="the throne", denied=("chair",))
    painted.paint(*CHAIR, "stool")
    look(20 * MINUTE_NS)
    (stool,) = memory.instances()
    assert (stool.label, stool.believed, stool.name) == ("stool", "stool", "the throne")
    painted.paint(*CHAIR, "chair")
    look(30 * MINUTE_NS)
    (chair,) = memory.instances()
    assert (chair.label, chair.name, chair.denied) == ("chair", "the throne", ("chair",))
    assert chair.believed != "chair"
    assert memory.note(99, name="nobody", denied=()) is None


def test_things_that_people_spoke_of_are_forgotten_last():
    memory = InstanceMemory(MemoryConfig(max_instances=2))
    first = memory.note_find(find("hat"), 1)
    memory.note(first.instance_id, name="the old hat", denied=())
    memory.note_find(find("mug", (5.0, 5.0, 0.5)), 2)
    memory.note_find(find("keys", (9.0, 5.0, 0.5)), 3)
    assert [one.label for one in memory.instances()] == ["hat", "keys"]
