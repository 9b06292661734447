"""Sentences read by rules and by a stand-in for the model."""

import numpy as np
import pytest
import simplejpeg

from app.links.language_model.interface import RULES, SentenceAnswer
from app.links.language_model.sentence_reading import search_of
from app.links.network.requests import RequestRefusedError, ask
from app.messages import keys
from app.messages.control import PictureRequest, SearchRequest, SentenceReading, SentenceRequest
from app.nodes.navigator.services import sentence_service
from app.nodes.navigator.services.goal_service import GoalService
from ippon.guidance.language.goals.goal import Attribute, Goal, Request
from ippon.guidance.language.requests.sentence import search_name
from ippon.rooms.named_rooms import RoomName
from tests.app.memory.test_memory_file import thing
from tests.app.nodes.navigator.conftest import MODEL, Model


def test_a_sentence_is_read_by_rules_where_there_is_no_model(open_office):
    office = open_office()
    request = SentenceRequest(sentence="find my red hat, I think I left it on the sofa")
    reading = ask(office.client, f"r/{keys.SENTENCE}", request, SentenceReading, 5.0)
    (goal,) = reading.goals
    assert (goal.object, goal.display) == ("hat", "red hat")
    assert goal.context == "I think I left it on the sofa"
    assert (reading.provider, reading.doubtful, reading.note) == (RULES, False, "")
    assert reading.notes == []


def test_names_of_one_object_are_one_search_and_the_answer_says_so(open_office):
    request = SentenceRequest(sentence="find my tv, television and telly")
    reading = open_office().sentences.read(request)
    assert [goal.display for goal in reading.goals] == ["tv"]
    assert reading.notes[1] == "“telly” means the same as “tv”: it is searched for once"


@pytest.mark.parametrize("by", ["rules", "model"])
def test_more_than_can_be_counted_give_no_goal_and_the_reading_says_so(open_office, by):
    office = open_office(Model() if by == "model" else None)
    if by == "model":
        screws = Goal(object="screw", display="screws", count=200)
        read = SentenceAnswer(Request(goals=(screws,), doubtful=False), MODEL, "q", "a", "")
        office.model.read_request = lambda *_: read
    reading = office.sentences.read(SentenceRequest(sentence="find 200 screws and my hat"))
    assert (reading.goals, reading.doubtful, reading.notes) == ([], True, [])
    assert reading.because == "at most 99 of one kind are counted; got 200. Ask for all of them"
    reading = open_office().sentences.read(SentenceRequest(sentence="find 99 screws"))
    assert [search_of(goal, "me").count for goal in reading.goals] == [99]
    assert not reading.doubtful


def test_a_sentence_is_read_by_the_model_within_its_time(open_office, monkeypatch):
    office = open_office(Model())
    office.model.may_answer.release()
    reading = office.sentences.read(SentenceRequest(sentence="the thing for my head"))
    assert (reading.goals[0].object, reading.provider) == ("hat", MODEL)
    monkeypatch.setattr(sentence_service, "SENTENCE_TIMEOUT_S", 0.05)
    reading = office.sentences.read(SentenceRequest(sentence="find my mug"))
    assert (reading.goals[0].object, reading.provider) == ("mug", RULES)
    assert reading.note == "no answer within 0.05 s"


def test_the_time_that_a_request_waited_for_others_counts_as_the_models(open_office, monkeypatch):
    office = open_office(Model())
    monkeypatch.setattr(sentence_service, "waited_s", lambda: 8.0)
    reading = office.sentences.read(SentenceRequest(sentence="find my mug"))
    assert (reading.goals[0].object, reading.provider) == ("mug", RULES)
    assert reading.note == "no answer within 8 s"
    monkeypatch.setattr(sentence_service, "waited_s", lambda: 20.0)
    with pytest.raises(RequestRefusedError, match=r"did not say within 20 s what"):
        office.sentences.read_picture(PICTURE)


def test_a_sentence_may_refer_to_the_goal_that_was_asked_for_last(open_office):
    office = open_office()
    request = SentenceRequest(sentence="the other one, please")
    assert office.sentences.read(request).goals == []
    office.goals.add(office.guidance.plan(SearchRequest(object="red mug"), 0.0))
    reading = office.sentences.read(request)
    assert (reading.goals[0].object, reading.goals[0].refers_to) == ("mug", "other")


def test_the_other_one_of_a_thing_with_a_name_is_another_of_its_kind(open_office):
    office = open_office()
    orders = GoalService(office.goals, office.guidance, stop_latch=None, operations=None)
    orders.things = lambda: (thing(7, label="mug", name="Rosie"),)
    office.goals.add(orders.plan(SearchRequest(object="Rosie")))
    (goal,) = office.sentences.read(SentenceRequest(sentence="the other one, please")).goals
    assert (goal.object, goal.display, goal.refers_to) == ("mug", "mug", "other")


def test_the_name_of_a_thing_is_read_and_searched_for(open_office):
    office = open_office()
    mug = thing(7, label="mug", name="Anna's mug")
    office.sentences.things = lambda: (mug,)
    orders = GoalService(office.goals, office.guidance, stop_latch=None, operations=None)
    orders.things = office.sentences.things
    reading = office.sentences.read(SentenceRequest(sentence="find Anna's mug, it is in the hall"))
    (goal,) = reading.goals
    assert (goal.display, reading.doubtful) == ("Anna's mug", False)
    search = orders.plan(SearchRequest(object=search_name(goal), context=goal.context))
    assert (search.goal.object, search.goal.display) == ("mug", "Anna's mug")
    assert search.goal.thing_id == 7
    owner = [Attribute(kind="owner", value="Anna")]
    search = orders.plan(SearchRequest(object="mug", attributes=owner))
    assert search.goal.thing_id == 7
    assert search.goal.attributes == ()
    assert orders.plan(SearchRequest(object="mug")).goal.thing_id is None
    denied = [Attribute(kind="owner", value="Anna", negated=True)]
    search = orders.plan(SearchRequest(object="mug", attributes=denied))
    assert search.goal.thing_id is None, "not Anna's"
    mug = thing(7, label="mug", name="Anna's mug", alternatives=(), denied=("mug",))
    orders.things = lambda: (mug,)
    with pytest.raises(RequestRefusedError, match="nobody knows of what"):
        orders.plan(SearchRequest(object="Anna's mug"))


def test_another_language_names_no_object(open_office):
    reading = open_office().sentences.read(SentenceRequest(sentence="suche meinen Hut, Sofa"))
    assert (reading.goals, reading.language, reading.doubtful) == ([], "German", True)
    assert "--llm.model" in reading.because


PICTURE = PictureRequest(jpeg=simplejpeg.encode_jpeg(np.zeros((48, 64, 3), np.uint8)))


def test_the_model_names_what_a_picture_shows_within_its_time(open_office, monkeypatch):
    office = open_office(Model())
    office.model.may_answer.release()
    reading = ask(office.client, f"r/{keys.PICTURE}", PICTURE, SentenceReading, 5.0)
    assert (reading.goals[0].display, reading.provider) == ("red mug", MODEL)
    monkeypatch.setattr(sentence_service, "PICTURE_TIMEOUT_S", 0.05)
    with pytest.raises(RequestRefusedError, match=r"did not say within .* s what"):
        office.sentences.read_picture(PICTURE)


def test_a_picture_without_a_model_or_that_is_none_is_refused(open_office):
    with pytest.raises(RequestRefusedError, match=r"start it with --llm\.model NAME"):
        open_office().sentences.read_picture(PICTURE)
    with pytest.raises(RequestRefusedError, match="not a JPEG image"):
        open_office(Model()).sentences.read_picture(PictureRequest(jpeg=b"none at all"))


@pytest.mark.parametrize("context", ["in Annas Zimmer", "in Anna's room", "not in the Lager"])
def test_a_room_that_has_been_named_is_understood(open_office, context):
    office = open_office()
    plain = office.guidance.plan(SearchRequest(object="scarf"), 0.0).guidance
    names = [RoomName(x_m=0.0, y_m=0.0, name=name) for name in ("Annas Zimmer", "Lager")]
    office.sentences.room_names = office.guidance.room_names = lambda: tuple(names)
    reading = office.sentences.read(SentenceRequest(sentence=f"scarf {context}"))
    assert reading.notes == []
    planned = office.guidance.plan(SearchRequest(object="scarf", context=context), 0.0)
    assert planned.guidance.notes == plain.notes
    assert planned.guidance.rows == plain.rows, "the name of a room says nothing of things"
