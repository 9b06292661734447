"""What needs a person, from the status and the events of a navigator."""

import msgspec
import pytest

from app.messages.recording import RecordingStatus
from app.messages.status import CountedFind, Event, FindReport, GoalStatus
from app.nodes.console.calls.call_detection import LASTS_S, STUCK_TIMES, CallDetection
from app.view.words import Words
from tests.app.nodes.console.drawn_home import status_of

FIND = FindReport(
    goal_id=1, object="hat", position_world=(1.0, 2.0, 0.5), size_m=(0.3, 0.3, 0.2),
    probability=0.97, voxels=14,
)  # fmt: skip


@pytest.fixture
def watch():
    """Steps a detection; returns the kinds and texts of what has come up."""
    detection = CallDetection()

    def step(status=None, now_s=0.0, *, silence_s=0.0, recording=None, several=(), contacts=0):
        for _ in range(contacts):
            detection.hear(Event(stamp_ns=1, kind="contact", text="touched"), now_s)
        recordings = () if recording is None else (recording,)
        told = detection.step(status, several or recordings, silence_s, now_s)
        return [(one.kind, one.text) for one in told]

    return step


def found(outcome="found", *, goal=None, **changes):
    goal = goal or GoalStatus(goal_id=1, object="hat", outcome=outcome)
    return status_of("found", goal=goal, find=msgspec.structs.replace(FIND, **changes))


def test_a_find_calls_once_until_it_is_another_one(watch):
    assert watch(status_of()) == []
    assert watch(found()) == [("found", "hat: confirm or reject it")]
    assert watch(found()) == []
    assert watch(status_of()) == []
    other = found(position_world=(4.0, 2.0, 0.5))
    assert watch(other) == [("found", "hat: confirm or reject it")]


def test_a_doubtful_find_one_out_of_reach_and_none_have_their_own_words(watch):
    assert watch(found(perhaps=True))[0] == (
        "perhaps", "hat: nothing looks more like it; confirm or reject it",
    )  # fmt: skip
    assert watch(found("out_of_reach", out_of_reach_m=1.42)) == [
        ("out_of_reach", "hat: 1.4 m from where the robot can stand")
    ]
    goal = GoalStatus(goal_id=2, object="hat", display="Anna's hat", outcome="exhausted")
    assert watch(status_of("exhausted", goal=goal)) == [
        ("not_found", "searched everywhere it can reach for: Anna's hat")
    ]


def test_a_search_that_ended_in_vain_calls_once_whatever_else_happens(watch):
    gone = GoalStatus(goal_id=2, object="hat", outcome="exhausted")
    assert watch(status_of("exhausted", goal=gone))
    for state in ("lost", "exhausted", "manual", "exhausted"):
        assert watch(status_of(state, goal=gone)) == []
    mug = GoalStatus(goal_id=3, object="mug", outcome="active")
    assert watch(status_of(goal=mug, history=[gone])) == []
    mug_gone = GoalStatus(goal_id=3, object="mug", outcome="exhausted")
    assert watch(status_of("exhausted", goal=mug_gone))


def test_an_end_whose_state_nobody_saw_calls_while_the_next_goal_runs(watch):
    assert watch(status_of(goal=GoalStatus(goal_id=1, object="hat"))) == []
    gone = GoalStatus(goal_id=1, object="hat", outcome="exhausted")
    mug = GoalStatus(goal_id=2, object="mug", outcome="active")
    next_one = status_of(goal=mug, history=[gone])
    assert [kind for kind, _ in watch(next_one)] == ["not_found"]
    assert watch(next_one) == []


def test_goals_of_a_tour_that_end_together_call_once(watch):
    going = [GoalStatus(goal_id=n, object=name, tour=1) for n, name in ((1, "hat"), (2, "mug"))]
    assert watch(status_of(goal=going[0], tour=going)) == []
    gone = [msgspec.structs.replace(one, outcome="exhausted") for one in going]
    (told,) = watch(status_of("exhausted", goal=gone[0], tour=gone))
    assert told[1].endswith("hat, mug")


def test_what_was_not_found_before_the_console_started_calls_nobody(watch):
    gone = GoalStatus(goal_id=1, object="hat", outcome="exhausted")
    mug = GoalStatus(goal_id=2, object="mug", outcome="active")
    assert watch(status_of(goal=mug, history=[gone])) == []


def test_a_navigator_that_counts_from_one_again_calls_again(watch):
    hat, mug = (GoalStatus(goal_id=1, object=name, outcome="active") for name in ("hat", "mug"))
    for goal in (hat, hat, mug):
        assert watch(status_of(goal=goal)) == []
        gone = msgspec.structs.replace(goal, outcome="exhausted")
        (told,) = watch(status_of("exhausted", goal=gone))
        assert told[1].endswith(goal.object)


def test_a_german_call_says_the_name_and_programs_get_the_label():
    (call,) = CallDetection(Words("de")).step(found(), (), 0.0, 0.0)
    assert (call.text, call.object) == ("Hut: bestätigen oder verwerfen", "hat")


def test_a_find_that_is_judged_or_not_reached_yet_calls_nobody(watch):
    judged = GoalStatus(goal_id=1, object="hat", outcome="found", confirmed=True)
    assert watch(found(goal=judged)) == []
    assert watch(found("active")) == []


def test_each_find_of_several_calls_while_the_search_goes_on(watch):
    first = CountedFind(number=1, position_world=(1.0, 2.0, 0.5))
    second = CountedFind(number=2, position_world=(4.0, 2.0, 0.5))
    hats = GoalStatus(goal_id=1, object="hat", count="all", outcome="active")

    def counted(*finds):
        return watch(status_of(goal=msgspec.structs.replace(hats, counted=list(finds))))

    assert counted(first) == [("found", "hat 1: confirm or reject it")]
    assert counted(first, second) == [("found", "hat 2: confirm or reject it")]
    ended = msgspec.structs.replace(hats, counted=[first], outcome="found", find=2)
    assert watch(found(goal=ended, number=2, position_world=second.position_world)) == []
    assert counted(msgspec.structs.replace(first, confirmed=True)) == []


def test_a_confirmed_find_of_several_calls_nobody(watch):
    seen = CountedFind(number=1, position_world=(1.0, 2.0, 0.5), confirmed=True)
    hats = GoalStatus(goal_id=1, object="hat", count=2, outcome="active", counted=[seen])
    assert watch(status_of(goal=hats)) == []


def test_the_find_of_a_tour_calls_though_another_goal_leads(watch):
    tour = [
        GoalStatus(goal_id=1, object="hat", outcome="found", tour=1),
        GoalStatus(goal_id=2, object="mug", outcome="active", tour=1),
    ]
    assert watch(status_of("searching", goal=tour[1], tour=tour, find=FIND)) == [
        ("found", "hat: confirm or reject it")
    ]


def test_what_is_lost_for_a_moment_calls_nobody(watch):
    lost = status_of("lost", why="waiting for camera/color (1.2 s)")
    assert watch(lost, 10.0) == []
    assert watch(status_of(), 11.0) == []
    assert watch(lost, 12.0) == []
    assert watch(lost, 12.0 + LASTS_S) == [("contact", "waiting for camera/color (1.2 s)")]
    assert watch(lost, 30.0) == []
    assert watch(status_of(), 40.0, silence_s=LASTS_S + 0.1) == [
        ("contact", "the navigator has been silent for more than 5 s")
    ]


def test_a_robot_that_does_not_know_where_it_is_calls_for_that_alone(watch):
    jumped = "the pose jumped by 4.2 m"
    astray = status_of("lost", localization=jumped, why=f"frames are refused: {jumped}")
    watch(astray, 0.0)
    assert watch(astray, LASTS_S) == [("lost", jumped)]
    silent = status_of("lost", localization=jumped, why="waiting for colour (5.0 s)")
    watch(silent, 20.0)
    assert watch(silent, 20.0 + LASTS_S) == [("contact", "waiting for colour (5.0 s)")]


def test_a_robot_that_does_not_get_on_calls_and_one_that_touches_twice_does_not(watch):
    assert watch(status_of(), 0.0, contacts=STUCK_TIMES - 1) == []
    assert watch(status_of(), 100.0, contacts=STUCK_TIMES - 1) == []
    (told,) = watch(status_of(), 101.0, contacts=1)
    assert told[0] == "stuck"
    assert watch(status_of(), 102.0, contacts=1) == []


def test_a_disk_that_fills_calls_and_so_does_a_recording_that_failed(watch):
    near = RecordingStatus(state="recording", text="", warning="2.4 GB are free on the disk")
    assert watch(status_of(), recording=near) == [("disk", "2.4 GB are free on the disk")]
    nearer = msgspec.structs.replace(near, warning="2.3 GB are free on the disk")
    assert watch(status_of(), recording=nearer) == []
    failed = RecordingStatus(state="failed", text="the disk is full")
    assert watch(status_of(), recording=failed) == [("disk", "the disk is full")]


def test_of_two_recorders_the_one_in_danger_calls_once(watch):
    full = RecordingStatus(state="failed", text="the disk is full", session="a")
    fine = RecordingStatus(state="recording", text="recording", session="b")
    assert watch(status_of(), several=(full, fine)) == [("disk", "the disk is full")]
    assert watch(status_of(), several=(full, fine)) == []
    near = msgspec.structs.replace(fine, warning="2.4 GB are free on the disk")
    assert watch(status_of(), several=(full, near)) == [("disk", "2.4 GB are free on the disk")]


def test_a_find_of_a_tour_calls_once_though_another_one_was_judged_in_between(watch):
    tv = GoalStatus(goal_id=1, object="tv", outcome="found", tour=1)
    chair = GoalStatus(goal_id=2, object="chair", outcome="found", tour=1)
    first = status_of("found", goal=chair, tour=[tv, chair], find=FIND)
    second = msgspec.structs.replace(FIND, goal_id=2, position_world=(4.0, 2.0, 0.5))
    assert watch(first) == [("found", "tv: confirm or reject it")]
    assert watch(msgspec.structs.replace(first, find=second)) == [
        ("found", "chair: confirm or reject it")
    ]
    assert watch(first) == []
