"""Sentences read by rules and by a stand-in for the model."""

from app.links.language_model.interface import RULES
from app.links.network.requests import ask
from app.messages import keys
from app.messages.control import SentenceReading, SentenceRequest
from app.nodes.navigator.services import sentence_service
from tests.app.nodes.navigator.conftest import MODEL, Model


def test_a_sentence_is_read_by_rules_where_there_is_no_model(open_office):
    office = open_office()
    request = SentenceRequest(sentence="find my hat, I think I left it on the sofa")
    reading = ask(office.client, f"r/{keys.SENTENCE}", request, SentenceReading, 5.0)
    assert (reading.object, reading.context) == ("hat", "I think I left it on the sofa")
    assert (reading.provider, reading.doubtful, reading.note) == (RULES, False, "")


def test_a_sentence_is_read_by_the_model_within_its_time(open_office, monkeypatch):
    office = open_office(Model())
    office.model.may_answer.release()
    reading = office.sentences.read(SentenceRequest(sentence="the thing for my head"))
    assert (reading.object, reading.provider) == ("hat", MODEL)
    monkeypatch.setattr(sentence_service, "SENTENCE_TIMEOUT_S", 0.05)
    reading = office.sentences.read(SentenceRequest(sentence="find my mug"))
    assert (reading.object, reading.provider) == ("mug", RULES)
    assert reading.note == "no answer within 0.05 s"
