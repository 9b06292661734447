from msgspec.structs import replace

from app.messages.status import CountedFind, GoalStatus
from app.nodes.console.calls.call import KINDS, Occasion
from app.nodes.console.calls.call_detection import LASTS_S, CallDetection
from app.nodes.console.calls.call_log import EVERY_S, KEPT, CallLog
from tests.app.nodes.console.drawn_home import status_of


def occasion(text="hat", kind="found"):
    return Occasion(kind=kind, text=text)


def told(log):
    return [(one.number, one.occasion.text, one.count, one.webhook) for one in log.shown().calls]


def test_every_kind_has_a_title():
    assert set(CallLog().shown().titles) == set(KINDS)


def test_one_call_of_a_kind_in_a_minute_and_none_is_lost():
    sent, log = [], CallLog()
    log.send_to(sent.append, "https://example.org")
    log.step([occasion("hat"), occasion("stairs", "stuck")], 0.0, 1)
    log.step([occasion("mug")], 10.0, 2)
    log.step([occasion("keys")], 20.0, 3)
    assert [call.occasion.text for call in sent] == ["hat", "stairs"]
    log.step([], EVERY_S - 0.1, 4)
    assert len(sent) == 2
    log.step([], EVERY_S, 5)
    assert told(log)[0] == (3, "keys", 2, "is being sent")
    assert [call.number for call in sent] == [1, 2, 3]
    log.step([], 10 * EVERY_S, 6)
    assert len(sent) == 3


def test_a_state_that_was_held_back_and_is_over_is_only_counted():
    log, silent, detection = CallLog(), LASTS_S + 1.0, CallDetection()

    def after(now_s, silence_s):
        occasions = detection.step(status_of(), [], silence_s, now_s)
        log.step(occasions, now_s, 1, detection.holding)
        return [(one.occasion.kind, one.count) for one in log.shown().calls]

    assert after(0.0, silent) == [("contact", 1)]
    after(10.0, 0.0)
    after(20.0, silent)
    after(27.0, 0.0)
    assert after(EVERY_S, 0.0) == [("contact", 1)], "it is heard again"
    assert after(2 * EVERY_S, silent) == [("contact", 2), ("contact", 1)]
    after(2 * EVERY_S + 1.0, 0.0)
    after(2 * EVERY_S + 2.0, silent)
    assert after(3 * EVERY_S, silent)[0] == ("contact", 1), "it lasts"


def test_what_became_of_a_call_is_noted_and_old_calls_are_dropped():
    log = CallLog()
    log.step([occasion()], 0.0, 1)
    assert told(log) == [(1, "hat", 1, "")]
    log.note(1, "arrived")
    log.note(99, "arrived")
    assert told(log) == [(1, "hat", 1, "arrived")]
    for k in range(1, 2 * KEPT):
        log.step([occasion(str(k))], EVERY_S * k, 1)
    assert len(told(log)) == KEPT
    assert told(log)[0][1] == str(2 * KEPT - 1)


def find_of(goal_id, number):
    return Occasion(
        kind="found",
        text="hat",
        goal_id=goal_id,
        object="hat",
        position_world=(1.0, 2.0, 0.5),
        find=number,
    )


def test_finds_that_were_judged_say_so_and_are_not_called_for_any_more():
    log, goal = CallLog(), GoalStatus(goal_id=1, object="hat", tour=1)
    log.step([find_of(1, 1)], 0.0, 1)
    log.step([find_of(2, 1)], 10.0, 2)
    log.follow(status_of(goal=goal))
    assert [one.judged for one in log.shown().calls] == [""]
    rejected, confirmed = replace(goal, rejected=1), replace(goal, goal_id=2, confirmed=True)
    log.follow(status_of(goal=rejected, tour=[rejected, confirmed]))
    log.step([find_of(1, 2)], 2 * EVERY_S, 3)
    again = replace(rejected, confirmed=True)
    log.follow(status_of(goal=again, tour=[again, confirmed]))
    assert [one.judged for one in log.shown().calls] == ["confirmed", "rejected"]


def test_of_several_finds_of_one_goal_each_has_its_own_verdict():
    log = CallLog()
    counted = [CountedFind(number=1, position_world=(1.0, 2.0, 0.5), confirmed=True)]
    log.step([find_of(1, 1)], 0.0, 1)
    log.step([find_of(1, 2)], 2 * EVERY_S, 2)
    log.follow(status_of(goal=GoalStatus(goal_id=1, object="hat", count=3, counted=counted)))
    assert [one.judged for one in log.shown().calls] == ["", "confirmed"]


def test_the_last_of_several_finds_and_a_rejected_one_have_their_verdicts():
    log = CallLog()
    counted = [CountedFind(number=1, position_world=(1.0, 2.0, 0.5))]
    two = GoalStatus(goal_id=1, object="hat", count=2, counted=counted, outcome="found", find=2)
    log.step([find_of(1, 2)], 0.0, 1)
    log.step([find_of(1, 1), find_of(1, 3)], 10.0, 2)
    log.follow(status_of(goal=two))
    assert [one.judged for one in log.shown().calls] == [""]
    log.follow(status_of(goal=replace(two, confirmed=True, rejected=1)))
    log.step([], 2 * EVERY_S, 3)
    first, second = log.shown().calls
    assert (first.occasion.find, first.count) == (1, 1), "the third is not called for"
    assert second.judged == "confirmed"
    log = CallLog()
    log.step([find_of(1, 2)], 0.0, 1)
    log.follow(status_of(goal=replace(two, outcome="active", find=None, rejected=1)))
    assert [one.judged for one in log.shown().calls] == ["rejected"]


def test_the_last_find_of_a_navigator_that_does_not_number_it_is_not_rejected():
    log = CallLog()
    counted = [CountedFind(number=1, position_world=(1.0, 2.0, 0.5), confirmed=True)]
    two = GoalStatus(goal_id=1, object="hat", count=2, counted=counted, outcome="found", rejected=1)
    log.step([find_of(1, 3)], 0.0, 1)
    log.step([find_of(1, 1)], EVERY_S, 2)
    log.follow(status_of(goal=two))
    assert [one.judged for one in log.shown().calls] == ["confirmed", ""]


def test_a_goal_that_the_navigator_does_not_know_any_more_cannot_be_repeated():
    log = CallLog()
    lost = Occasion(kind="not_found", text="none", goal_id=1, object="hat")
    log.step([lost, occasion("stairs", "stuck")], 0.0, 1)
    hat = GoalStatus(goal_id=1, object="hat", outcome="exhausted")
    log.follow(status_of(goal=hat))
    assert {one.occasion.kind: one.occasion.goal_id for one in log.shown().calls} == {
        "not_found": 1, "stuck": None,
    }  # fmt: skip
    # A navigator that was started again counts from 1.
    log.follow(status_of(goal=replace(hat, object="cup")))
    assert [one.occasion.goal_id for one in log.shown().calls] == [None, None]
