"""The lease over real zenoh sessions."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

from app.links.network.requests import RequestRefusedError, ask, serve
from app.messages import keys
from app.messages.control import (
    Accepted,
    ControlReply,
    ControlRequest,
    FeedbackRequest,
)
from app.messages.driving import TeleopTag
from app.messages.lease import Credential, LeaseReply, LeaseRequest, TakeRequest, sender_of
from app.nodes.navigator.services.lease_service import LeaseService
from app.nodes.navigator.services.request_services import declare_endpoints

PATIENCE_S = 20.0
ANNA = Credential(session="a" * 20, name="Anna")
BERT = Credential(session="b" * 20, name="Bert")
CARL = Credential(session="c" * 20, name="Carl")


@pytest.fixture
def office(sessions):
    router, client = sessions
    clock = SimpleNamespace(now=100.0)
    service = LeaseService(lambda: clock.now)
    endpoints = declare_endpoints(router, "r", service)
    handled = []

    def handle(reply):
        def take(message):
            handled.append(message)
            return reply

        return take

    queryables = [
        serve(router, "r/feedback", FeedbackRequest, handle(Accepted()), service.authorize),
        serve(
            router,
            "r/control",
            ControlRequest,
            handle(ControlReply(state="stopped")),
            service.authorize,
        ),
    ]

    def request(action, who, requester=""):
        message = LeaseRequest(action=action, requester=requester)
        return ask(client, "r/lease", message, LeaseReply, PATIENCE_S, who)

    def command(who, message=FeedbackRequest(verdict="confirm"), kind=Accepted):  # noqa: B008
        key = "r/control" if isinstance(message, ControlRequest) else "r/feedback"
        return ask(client, key, message, kind, PATIENCE_S, who)

    yield SimpleNamespace(
        service=service,
        clock=clock,
        client=client,
        request=request,
        command=command,
        handled=handled,
    )
    del queryables, endpoints


def holding(office, who):
    reply = office.request("request", who)
    assert reply.standing == "holds"
    return Credential(session=who.session, name=who.name, epoch=reply.epoch)


def tag_of(who, epoch, seq):
    return TeleopTag(sender=sender_of(who.session), epoch=epoch, seq=seq)


def test_a_command_counts_for_everyone_while_nobody_holds_control(office):
    office.command(None)
    office.command(ANNA)
    assert len(office.handled) == 2


def test_a_command_without_the_lease_is_refused_with_the_reason(office):
    anna = holding(office, ANNA)
    for who in (None, BERT):
        with pytest.raises(RequestRefusedError, match="Anna has control: request it"):
            office.command(who)
    assert office.handled == []
    office.command(anna)
    assert len(office.handled) == 1


def test_stop_is_everyones_and_resume_is_not(office):
    holding(office, ANNA)
    assert office.command(None, ControlRequest(action="stop"), ControlReply).state == "stopped"
    assert office.command(BERT, ControlRequest(action="stop"), ControlReply).state == "stopped"
    with pytest.raises(RequestRefusedError, match="Anna has control"):
        office.command(BERT, ControlRequest(action="resume"), ControlReply)


def test_control_is_asked_for_and_granted(office):
    anna = holding(office, ANNA)
    assert office.request("request", BERT).standing == "waits"
    assert office.service.status().requester == "Bert"
    office.request("grant", anna)
    bert = holding(office, BERT)
    office.command(bert)


@pytest.mark.parametrize("answer", ["grant", "deny"])
def test_an_answer_reaches_no_other_requester_than_the_one_it_names(office, answer):
    anna = holding(office, ANNA)
    office.request("request", BERT)
    office.request("release", BERT)
    office.request("request", CARL)
    with pytest.raises(RequestRefusedError, match="Bert no longer asks for control"):
        office.request(answer, anna, requester="Bert")
    assert office.service.status().holder == "Anna"
    assert office.service.status().requester == "Carl"
    office.request(answer, anna, requester="Carl")
    assert office.service.status().requester == ""


def test_a_supervisor_takes_control_by_a_key_of_its_own(office):
    holding(office, ANNA)
    key = f"r/{keys.LEASE_TAKE}"
    assert ask(office.client, key, TakeRequest(), LeaseReply, PATIENCE_S, BERT).standing == "holds"
    assert office.service.status().holder == "Bert"


@pytest.mark.parametrize("who", [None, Credential(session="short", name="x")])
def test_whoever_asks_must_say_who_they_are(office, who):
    with pytest.raises(RequestRefusedError, match=r"credential|Credential"):
        office.request("request", who)


@pytest.mark.parametrize("name", ["", "x" * 41, "two\nlines", "bell\a"])
def test_a_name_is_one_short_line(office, name):
    with pytest.raises(RequestRefusedError, match="not a Credential"):
        office.request("request", Credential(session="a" * 20, name=name))


def test_an_attachment_that_is_no_credential_is_refused(office):
    replies = office.client.get("r/feedback", payload=b'{"verdict":"confirm"}', attachment=b"{")
    (reply,) = list(replies)
    assert b"the attachment is not a Credential" in reply.ok.payload.to_bytes()
    assert office.handled == []


@pytest.mark.parametrize("attached", [b"{", b'{"session": "aaaaaaaaaaaaaaaaaaaa", "of": "1.9"}'])
def test_stop_needs_no_credential_that_can_be_read(office, attached):
    replies = office.client.get("r/control", payload=b'{"action":"stop"}', attachment=attached)
    (reply,) = list(replies)
    assert b'"stopped"' in reply.ok.payload.to_bytes()
    replies = office.client.get("r/control", payload=b'{"action":"resume"}', attachment=attached)
    (reply,) = list(replies)
    assert b"the attachment is not a Credential" in reply.ok.payload.to_bytes()
    assert office.handled == [ControlRequest(action="stop")]


def test_what_changes_is_told_once(office):
    assert office.service.watch() == ((), False, False)
    anna = holding(office, ANNA)
    assert office.service.watch() == (("Anna took control",), True, False)
    assert office.service.watch() == ((), False, False)
    office.clock.now += 1.5
    assert office.service.watch() == ((), True, False), "stale"
    office.clock.now += 1.0
    assert office.service.watch() == (("Anna is gone: the lease expired",), True, True)
    assert office.service.teleop_refusal(tag_of(anna, epoch=anna.epoch, seq=1))


def test_a_handover_takes_the_hand_off_the_wheels(office):
    holding(office, ANNA)
    office.service.watch()
    assert office.service.teleop_refusal(tag_of(ANNA, epoch=1, seq=1)) is None
    office.service.take(TakeRequest(), BERT)
    assert office.service.watch() == (("Bert took control from Anna",), True, True)
    assert office.service.teleop_refusal(tag_of(ANNA, epoch=1, seq=2))


def test_of_many_who_press_at_once_one_holds_and_one_waits(office):
    people = [Credential(session=f"{n:020d}", name=f"number {n}") for n in range(8)]
    with ThreadPoolExecutor(8) as pool:
        replies = list(pool.map(lambda who: office.request("request", who), people))
    standings = sorted(reply.standing for reply in replies)
    assert standings == ["holds", "waits", *["watches"] * 6]


def test_only_others_see_the_name_of_who_has_control():
    service = LeaseService(lambda: 0.0)
    assert service.holder_besides(ANNA) == ""
    anna = service.ask(LeaseRequest(action="request"), ANNA)
    assert service.holder_besides(BERT) == "Anna"
    assert service.holder_besides(None) == "Anna"
    own = Credential(session=ANNA.session, name=ANNA.name, epoch=anna.epoch)
    assert service.holder_besides(own) == ""
