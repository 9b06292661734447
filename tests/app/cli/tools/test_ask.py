"""`ippon ask` with a navigator that only reads sentences and takes searches."""

import json
import threading
from contextlib import nullcontext

import msgspec
import pytest
from PIL import Image

from app.cli.main import run
from app.cli.tools import ask as asking
from app.cli.tools import feedback
from app.cli.tools import follow as following
from app.links.language_model.interface import RULES, SentenceAnswer
from app.links.language_model.sentence_reading import as_reading
from app.messages import keys
from app.messages.control import (
    Accepted,
    FeedbackRequest,
    PictureRequest,
    SearchAccepted,
    SearchRequest,
    SentenceRequest,
    decode,
    encode,
)
from app.messages.status import CountedFind, GoalStatus, Status, Timings
from ippon.guidance.language.requests.sentence import read_request
from ippon.guidance.prompts.picture_prompt import parse_picture_reply

searches_sure = ["true"]
"""Whether the stand-in's model is sure of what a picture shows."""


counts = []
"""How many each search wants."""
verdicts = []
"""What was said of finds."""
joins = []
"""The goal that each search joins, None for none."""


@pytest.fixture
def searches(monkeypatch):
    """Return the searches that a stand-in for the navigator takes."""
    taken = []
    joins.clear()
    verdicts.clear()
    counts.clear()
    searches_sure[0] = "true"

    def answer(session, key, request, kind, *rest):
        if isinstance(request, SentenceRequest):
            return as_reading(
                SentenceAnswer(read_request(request.sentence), RULES, "", "", ""), 1.0
            )
        if isinstance(request, FeedbackRequest):
            verdicts.append(request)
            return Accepted(detail="done")
        if isinstance(request, PictureRequest):
            named = parse_picture_reply(f'{{"name": "red mug", "sure": {searches_sure[0]}}}')
            return as_reading(SentenceAnswer(named, "tiny", "", "", ""), 1.0)
        assert isinstance(request, SearchRequest)
        taken.append((request.object, request.context))
        joins.append(request.joins)
        counts.append(request.count)
        return SearchAccepted(
            goal_id=len(taken),
            object=request.object,
            position=len(taken) - 1 if request.joins is None else 0,
            notes=["a note"],
            joined=request.joins,
        )

    monkeypatch.setattr(asking, "ask", answer)
    monkeypatch.setattr(feedback, "ask", answer)
    monkeypatch.setattr(feedback, "request_credential", lambda *_, **__: nullcontext(None))
    monkeypatch.setattr(asking, "open_client", lambda *_: nullcontext())
    monkeypatch.setattr(asking, "is_alive", lambda *_: True)
    monkeypatch.setattr(asking, "subscribe", lambda *_: None)
    monkeypatch.setattr(asking, "request_credential", lambda *_, **__: nullcontext(None))
    return taken


def ask(*arguments):
    return run(["ask", *arguments, "--connect", "tcp/127.0.0.1:1"])


def test_several_goals_are_queued_in_order(searches, capsys):
    assert ask("the red mug next to the sink, then my keys and two chairs") == 0
    assert searches == [("red mug", "next to the sink"), ("keys", ""), ("chairs", "")]
    assert counts == [1, 1, 2]
    out = capsys.readouterr().out
    assert [line.split(" (")[0] for line in out.splitlines() if line.startswith("searching")] == [
        "searching for red mug", "searching for keys", "searching for chairs"
    ]  # fmt: skip


def test_more_than_can_be_counted_are_refused_in_words(searches, capsys):
    assert ask("find 200 screws", "--yes") == 2
    assert searches == []
    assert "at most 99 of one kind are counted; got 200" in capsys.readouterr().err


def test_objects_joined_by_and_are_searched_for_in_one_tour(searches, capsys):
    assert ask("my keys and my wallet, then the hat") == 0
    assert [name for name, _ in searches] == ["keys", "wallet", "hat"]
    assert joins == [None, 1, None]
    lines = [x for x in capsys.readouterr().out.splitlines() if x.startswith("searching")]
    assert lines == [
        "searching for keys (goal 1)",
        "searching for wallet (goal 2, in one tour with goal 1)",
        "searching for hat (goal 3, 2 before it)",
    ]


def status_of(tour, lead):
    """Return a status in which goals of a tour have outcomes."""
    goals = [
        GoalStatus(
            goal_id=n,
            object=name,
            outcome=outcome,
            position_world=(1.0, 2.0, 0.5) if outcome == "found" else None,
        )
        for n, (name, outcome) in enumerate(tour, 1)
    ]
    return Status(
        robot="r", version="0", stamp_ns=0, wall_ns=0, state="searching", why="on the way",
        goal=goals[lead - 1], queue=[], history=[], find=None, streams=[], timings=Timings(),
        frames=1, elapsed_s=3.0, path_length_m=0.0, best_ooi=0.0, explored_m2=0.0,
        surface_voxels=0, voxel_size_m=0.1, map_revision=1, tour=goals,
    )  # fmt: skip


@pytest.mark.parametrize(("last", "exit_status"), [("found", 0), ("exhausted", 1)])
def test_following_a_tour_prints_each_find_and_ends_with_the_last(
    searches, monkeypatch, capsys, last, exit_status
):
    statuses = [
        status_of([("keys", "active"), ("wallet", "active")], 1),
        status_of([("keys", "active"), ("wallet", "found")], 1),
        status_of([("keys", last), ("wallet", "found")], 1),
    ]
    publish_only(monkeypatch, [encode(status) for status in statuses])
    assert ask("my keys and my wallet", "--follow") == exit_status
    out = capsys.readouterr().out.splitlines()
    place = " at (1.0, 2.0) m, z = 0.5 m"
    end = place if last == "found" else ""
    assert out[-3:] == [
        "    3.0 s  searching: on the way", f"wallet: found{place}", f"keys: {last}{end}"
    ]  # fmt: skip
    searches.clear()
    assert ask("my keys and my wallet", "--follow", "--json") == exit_status
    lines = [json.loads(x) for x in capsys.readouterr().out.splitlines()][2:]
    assert [(x["object"], x["outcome"]) for x in lines] == [
        ("keys", "active"), ("keys", "active"), ("wallet", "found"), ("keys", last)
    ]  # fmt: skip
    assert lines[2]["position_world"] == [1.0, 2.0, 0.5]


def test_what_was_found_is_confirmed_and_rejected_by_number(searches, capsys):
    assert ask("--reject", "2", "--goal", "5") == 0
    assert ask("--confirm", "last") == 0
    assert verdicts == [
        FeedbackRequest(verdict="reject", goal_id=5, find=2), FeedbackRequest(verdict="confirm")
    ]  # fmt: skip
    assert capsys.readouterr().out == "done\ndone\n"
    assert ask("--confirm", "1", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"detail": "done"}


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("--confirm", "1", "--reject", "2"), "not both"),
        (("hat", "--reject", "2"), "in another command"),
        (("hat", "--goal", "2"), "--goal goes with"),
    ],
)
def test_a_verdict_and_a_search_are_two_commands(searches, capsys, options, problem):
    assert ask(*options) == 2
    assert problem in " ".join(capsys.readouterr().err.split())
    assert (verdicts, searches) == ([], [])


def test_following_a_search_for_several_prints_the_number_of_each_find(
    searches, monkeypatch, capsys
):
    first = CountedFind(number=1, position_world=(1.0, 2.0, 0.4))
    third = CountedFind(number=3, position_world=(3.0, 2.0, 0.4))
    ends = ([], "active"), ([first], "active"), ([first, third], "exhausted")

    def publish(session, topic, receive):
        for counted, outcome in ends if topic.endswith(keys.STATUS) else ():
            goal = GoalStatus(
                goal_id=1, object="chair", display="chairs", outcome=outcome, count=3,
                counted=counted,
            )  # fmt: skip
            receive(encode(msgspec.structs.replace(status_of([("chair", "active")], 1), goal=goal)))

    monkeypatch.setattr(asking, "subscribe", publish)
    assert ask("three chairs", "--follow") == 1
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "chairs: find 1 at (1.0, 2.0) m, z = 0.4 m",
        "chairs: find 3 at (3.0, 2.0) m, z = 0.4 m",
    ]


def test_following_prints_changed_words_at_once_and_changed_numbers_every_five_seconds(
    searches, monkeypatch, capsys
):
    said = [
        (1.0, "viewpoint: gain 12, 3.1 s away"), (1.2, "viewpoint: gain 12, 2.9 s away"),
        (1.4, "looking around"), (1.6, "viewpoint: gain 9, 1.0 s away"),
        (6.5, "viewpoint: gain 9, 0.4 s away"), (6.7, "viewpoint: gain 9, 0.2 s away"),
        (12.0, "viewpoint: gain 9, 0.2 s away"), (19.0, "viewpoint: gain 9, 0.2 s away"),
    ]  # fmt: skip
    going = status_of([("keys", "active")], 1)
    statuses = [msgspec.structs.replace(going, elapsed_s=at_s, why=why) for at_s, why in said]
    statuses.append(status_of([("keys", "found")], 1))
    publish_only(monkeypatch, [encode(status) for status in statuses])
    assert ask("my keys", "--follow") == 0
    lines = [x for x in capsys.readouterr().out.splitlines() if " s  searching: " in x]
    assert [line.split(" s  ")[0].strip() for line in lines] == ["1.0", "1.4", "1.6", "6.7", "3.0"]


def test_following_says_what_a_search_waits_for(searches, monkeypatch, capsys):
    before = GoalStatus(goal_id=7, object="tv", outcome="active")
    waits = msgspec.structs.replace(
        status_of([("keys", "queued")], 1), goal=before, why="stopped: press Resume to continue",
        queue=[GoalStatus(goal_id=1, object="keys", outcome="queued")], tour=[],
    )  # fmt: skip
    statuses = [waits, waits, status_of([("keys", "found")], 1)]
    publish_only(monkeypatch, [encode(status) for status in statuses])
    assert ask("my keys", "--follow") == 0
    lines = [x for x in capsys.readouterr().out.splitlines() if x.startswith("waits")]
    assert lines == ["waits for goal 7, tv: stopped: press Resume to continue"]


def publish_only(monkeypatch, payloads):
    def publish(session, topic, receive):
        for payload in payloads if topic.endswith(keys.STATUS) else ():
            receive(payload)

    monkeypatch.setattr(asking, "subscribe", publish)


def test_following_ends_where_the_navigator_does_not_know_the_goal_any_more(
    searches, monkeypatch, capsys
):
    begun = encode(status_of([("keys", "active")], 1))
    again = encode(msgspec.structs.replace(decode(begun, Status), goal=None, tour=[]))
    clock = iter((0.0, 1.0, 9.0, 12.0))
    monkeypatch.setattr(following.time, "monotonic", lambda: next(clock))
    publish_only(monkeypatch, [begun, again, again])
    assert ask("my keys", "--follow") == 2
    assert "does not list goal 1: it was perhaps started again" in capsys.readouterr().err


def publish_late(monkeypatch, payload, after_s):
    """Publish a status once the command has waited for a while, as a busy navigator does."""

    def publish(session, topic, receive):
        if topic.endswith(keys.STATUS):
            timer = threading.Timer(after_s, receive, (payload,))
            timer.daemon = True
            timer.start()

    monkeypatch.setattr(following, "SILENT_S", 0.1)
    monkeypatch.setattr(asking, "subscribe", publish)


def test_following_waits_for_a_navigator_that_is_connected_but_slow(searches, monkeypatch, capsys):
    publish_late(monkeypatch, encode(status_of([("keys", "found")], 1)), 0.5)
    assert ask("my keys", "--follow") == 0
    err = capsys.readouterr().err
    assert err.count("the navigator is connected but has reported nothing for 0.1 s") == 1


def test_following_ends_where_no_navigator_is_connected(searches, monkeypatch, capsys):
    publish_late(monkeypatch, encode(status_of([("keys", "found")], 1)), 60.0)
    tokens = iter((True,))  # before the request; then none
    monkeypatch.setattr(asking, "is_alive", lambda *_: next(tokens, False))
    assert ask("my keys", "--follow") == 2
    assert "the navigator is gone: it has been silent for 0.1 s" in capsys.readouterr().err


def test_following_ends_where_a_connected_navigator_reports_nothing_for_long(
    searches, monkeypatch, capsys
):
    publish_late(monkeypatch, encode(status_of([("keys", "found")], 1)), 60.0)
    monkeypatch.setattr(following, "HANGS_S", 0.3)
    assert ask("my keys", "--follow") == 2
    assert "is connected but has reported nothing for 0.3 s: its log" in capsys.readouterr().err


def test_following_a_navigator_of_another_version_says_so(searches, monkeypatch, capsys):
    publish_only(monkeypatch, [b'{"robot": "r", "mood": "good"}'])
    assert ask("my keys", "--follow") == 2
    assert "is of another version: Object " in capsys.readouterr().err


@pytest.mark.parametrize("yes", [(), ("--yes",)])
def test_another_language_starts_nothing(searches, capsys, yes):
    assert ask("suche meinen Hut auf dem Sofa", *yes) == 2
    assert searches == []
    err = capsys.readouterr().err
    assert "this looks like German" in err
    assert "--llm.model" in err


@pytest.mark.parametrize("sentence", ["find it", "thank you", "😀😀 😀", "<b>hat</b> now"])
def test_yes_starts_nothing_without_an_object(searches, sentence):
    assert ask(sentence, "--yes") == 2
    assert searches == []


def test_a_doubtful_reading_asks_first_and_yes_starts_it(searches, capsys):
    assert ask("find my flurbl") == 2
    assert "add --yes" in capsys.readouterr().err
    assert searches == []
    assert ask("find my flurbl", "--yes") == 0
    assert searches == [("flurbl", "")]


def test_a_sentence_is_read_also_beside_a_context(searches):
    assert ask("find my two red mugs", "--context", "in the kitchen") == 0
    assert searches == [("red mugs", "in the kitchen")]
    assert counts == [2]
    assert ask("don't bring my keys", "--context", "in the hall") == 2
    assert len(searches) == 1


@pytest.mark.parametrize("word", ["stop", "cancel", "wait", "halt", "nothing"])
def test_an_order_of_one_word_is_no_object(searches, word):
    assert ask(word, "--yes") == 2
    assert searches == []


def test_a_sentence_that_is_too_long_is_refused(searches, capsys):
    assert ask("find my hat and " * 700) == 2
    assert "a sentence has at most 2000 characters; yours has 11200" in capsys.readouterr().err


@pytest.fixture
def photo(tmp_path):
    Image.new("RGB", (64, 48), (200, 30, 30)).save(tmp_path / "mug.png")
    return str(tmp_path / "mug.png")


def test_a_picture_is_searched_for_by_what_it_shows(searches, capsys, photo):
    assert ask("--picture", photo, "--context", "in the kitchen") == 0
    assert searches == [("red mug", "in the kitchen")]
    assert "red" in capsys.readouterr().err


def test_a_picture_of_which_the_model_is_not_sure_waits_for_a_yes(searches, capsys, photo):
    searches_sure[0] = "false"
    assert ask("--picture", photo) == 2
    assert searches == []
    assert "not sure that the picture shows a red mug" in capsys.readouterr().err
    assert ask("--picture", photo, "--yes") == 0
    assert searches == [("red mug", "")]


def test_a_picture_stands_in_place_of_the_object(searches, capsys, photo, tmp_path):
    assert ask("mug", "--picture", photo) == 2
    assert "--picture stands in place of the object" in capsys.readouterr().err
    assert ask("--picture", str(tmp_path / "none.png")) == 2
    assert "cannot read the picture" in capsys.readouterr().err
    assert searches == []


@pytest.mark.parametrize("take", [False, True])
def test_a_common_object_is_added_with_the_control_that_was_taken(monkeypatch, searches, take):
    credentials = []

    def answer(session, key, request, kind, timeout_s, who):
        credentials.append((request.label, who))
        return Accepted(detail="added")

    monkeypatch.setattr(asking, "ask", answer)
    monkeypatch.setattr(asking, "request_credential", lambda *_, take: nullcontext(take))
    assert ask("--add-label", "bookcase", *["--take"] * take) == 0
    assert credentials == [("bookcase", take)]
