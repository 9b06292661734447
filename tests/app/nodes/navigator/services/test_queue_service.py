"""Changes of the queue by one operator, and by two at once."""

import random
import threading

import pytest

from app.links.network.requests import RequestRefusedError
from app.messages.control import SearchRequest
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.levels import Level
from tests.app.nodes.navigator.conftest import finds


def test_a_waiting_goal_is_moved_by_number_with_its_tour_or_cancelled(desk):
    for name in ("mug", "plant", "tv"):
        desk.search(name)
    desk.search("bed", joins=4)
    assert desk.waiting() == [2, 3, 4, 5]
    desk.ask(5, "before", before=3)
    assert desk.waiting() == [2, 4, 5, 3]
    desk.ask(4, "before", before=5)
    assert desk.waiting() == [2, 4, 5, 3], "goals of one tour have no order"
    assert desk.ask(3, "first") == "it is next"
    desk.ask(2, "remove")
    assert desk.waiting() == [3, 4, 5]
    for refused, number in (
        ({"goal_id": 2, "action": "before", "before": 3}, 2),
        ({"goal_id": 3, "action": "before", "before": 2}, 2),
        ({"goal_id": 1, "action": "remove"}, 1),
        ({"goal_id": 1, "action": "edit", "object": "cap"}, 1),
    ):
        with pytest.raises(RequestRefusedError, match=f"goal {number} is no longer waiting"):
            desk.ask(**refused)
    with pytest.raises(RequestRefusedError, match="before is the number of the goal"):
        desk.ask(3, "before")


def test_a_waiting_goal_is_edited_where_it_stands(desk):
    desk.search("mug", context="in the kitchen")
    desk.search("tv")
    desk.guidance.restore(2, {"bed": "certain"})
    assert desk.ask(2, "edit", context="on the desk") == "goal 2 is: mug"
    mug = desk.queue.find(2)
    assert (mug.goal.object, mug.goal.context, mug.waited) == ("mug", "on the desk", True)
    levels = {row.label: row.level for row in mug.guidance.rows}
    assert levels["bed"] is Level.CERTAIN, "what the operator set stays"
    desk.ask(2, "edit", object="red cap")
    cap = desk.queue.find(2)
    assert (cap.goal.display, cap.goal.context, cap.edits) == ("red cap", "on the desk", ())
    assert desk.waiting() == [2, 3]
    desk.search("bed", joins=3)
    with pytest.raises(RequestRefusedError, match="tv is in the tour of goal 4 already"):
        desk.ask(4, "edit", object="tv")
    with pytest.raises(RequestRefusedError, match="the object"):
        desk.ask(3, "edit", object=" ")


def test_an_ended_goal_is_repeated_once(desk):
    with pytest.raises(RequestRefusedError, match="goal 1 has not ended in this session"):
        desk.ask(1, "repeat")
    desk.queue.conclude("exhausted", 1)
    assert desk.ask(1, "repeat").startswith("looking for: hat")
    again = desk.queue.find(2)
    assert (again.goal.object, again.goal.context) == ("hat", "on the sofa")
    assert "goal 2 searches for it already" in desk.ask(1, "repeat")
    desk.queue.next()
    assert desk.waiting() == []
    desk.queue.conclude("exhausted", 2)
    assert desk.ask(1, "repeat").startswith("looking for: hat")
    assert desk.waiting() == [3]


def test_two_operators_at_once_lose_and_double_no_goal(desk):
    names = ("mug", "tv", "bed", "plant", "chair", "sofa", "table", "lamp")
    for name in names:
        desk.search(name)
    desk.queue.conclude("exhausted", 1)
    start = threading.Barrier(2)

    def press(seed):
        chance = random.Random(seed)
        start.wait()
        for _ in range(300):
            one, other = chance.randint(2, 9), chance.randint(2, 9)
            action = chance.choice(["before", "first", "remove", "edit", "repeat"])
            more = {"before": other} if action == "before" else {}
            if action == "remove" and one > 4:
                continue
            try:
                desk.ask(1 if action == "repeat" else one, action, **more)
            except RequestRefusedError as error:
                assert "waiting" in str(error)  # noqa: PT017 (some are refused)

    threads = [threading.Thread(target=press, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    _, queue, history = desk.queue.statuses()
    everything = [goal.goal_id for goal in (*queue, *history)]
    assert sorted(everything) == list(range(2, 11)), "each once, and the hat repeated once"
    by_number = {goal.goal_id: goal.object for goal in (*queue, *history)}
    assert tuple(by_number[k] for k in range(2, 10)) == names


def test_the_history_says_what_became_of_a_goal_and_how_long_it_took(desk):
    desk.search("mug")
    desk.queue.elapsed_s = 30.0
    (wrong,) = finds(1)
    desk.queue.conclude("found", 1, wrong)
    desk.queue.reopen(1)
    desk.queue.note_finds(1, (), (wrong,))
    desk.queue.elapsed_s = 73.04
    desk.queue.conclude("found", 1)
    desk.queue.confirm(1)
    desk.ask(2, "remove")
    desk.search("tv")
    desk.queue.next()
    desk.queue.elapsed_s = 12.0
    desk.queue.conclude("cancelled", 3)
    told = [
        (one.object, one.outcome, one.confirmed, one.rejected, one.took_s)
        for one in desk.queue.statuses()[2]
    ]
    assert told == [
        ("mug", "cancelled", False, 0, None),
        ("hat", "found", True, 1, 73.0),
        ("tv", "cancelled", False, 0, 12.0),
    ]


def test_an_edit_of_the_context_keeps_the_count_and_the_attributes(desk):
    red = Attribute(kind="colour", value="red")
    desk.goals.search(SearchRequest(object="chairs", count="all", attributes=[red]))
    desk.ask(2, "edit", object="chairs", context="in the hall")
    goal = desk.queue.find(2).goal
    assert (goal.context, goal.count, goal.attributes) == ("in the hall", "all", (red,))
