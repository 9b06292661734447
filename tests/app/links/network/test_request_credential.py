"""A program that takes control for a request, and gives it back."""

import pytest

from app.links.network.request_credential import request_credential
from app.links.network.requests import RequestRefusedError, ask, serve
from app.messages.control import Accepted, FeedbackRequest
from app.messages.lease import Credential, LeaseReply, LeaseRequest
from app.nodes.navigator.services.lease_service import LeaseService
from app.nodes.navigator.services.request_services import declare_endpoints

ANNA = Credential(session="a" * 20, name="Anna")
CONFIRM = FeedbackRequest(verdict="confirm")


@pytest.fixture
def control(sessions):
    router, client = sessions
    control = LeaseService(lambda: 0.0)
    endpoints = declare_endpoints(router, "r", control)
    endpoints.append(
        serve(router, "r/feedback", FeedbackRequest, lambda _: Accepted(), control.authorize)
    )
    ask(client, "r/lease", LeaseRequest(action="request"), LeaseReply, 20.0, ANNA)
    yield control
    del endpoints


def test_without_taking_it_a_held_control_stays_held(sessions, control):
    _, client = sessions
    with (
        request_credential(client, "r", "ippon ask", 20.0, take=False) as who,
        pytest.raises(RequestRefusedError, match="Anna has control: request it"),
    ):
        ask(client, "r/feedback", CONFIRM, Accepted, 20.0, who)
    assert control.status().holder == "Anna"


def test_what_was_taken_is_released(sessions, control):
    _, client = sessions
    with request_credential(client, "r", "ippon ask", 20.0, take=True) as who:
        assert control.status().holder == "ippon ask"
        ask(client, "r/feedback", CONFIRM, Accepted, 20.0, who)
    assert control.status().state == "free"
