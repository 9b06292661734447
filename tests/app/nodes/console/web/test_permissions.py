"""Who may send what, by role and by who has control."""

import pytest

from app.messages.control import ControlRequest, FeedbackRequest
from app.messages.lease import LeaseStatus
from app.messages.memory import MemoryNoteRequest, MemoryRequest
from app.nodes.console.web.browsers import Browser
from app.nodes.console.web.permissions import (
    may_command,
    may_send,
    may_use_panels,
    request_refusal,
    take_refusal,
)
from app.view.words import ENGLISH


def browser_of(role, standing="watches", epoch=0):
    browser = Browser("x" * 20, "Anna", role)
    browser.standing, browser.epoch = standing, epoch
    return browser


@pytest.mark.parametrize(
    ("role", "standing", "lease", "allowed"),
    [
        ("viewer", "watches", LeaseStatus(), False),
        ("operator", "watches", LeaseStatus(), True),
        ("operator", "watches", LeaseStatus(state="held", holder="Bert", epoch=2), False),
        ("operator", "holds", LeaseStatus(state="held", holder="Anna", epoch=2), True),
        ("supervisor", "waits", LeaseStatus(state="held", holder="Bert", epoch=2), False),
    ],
)
def test_panels_are_for_the_holder_or_for_every_operator_without_one(
    role, standing, lease, allowed
):
    assert may_use_panels(browser_of(role, standing, epoch=2), lease) is allowed


def test_a_holder_of_an_earlier_lease_may_not_use_the_panels():
    lease = LeaseStatus(state="held", holder="Bert", epoch=3)
    assert not may_use_panels(browser_of("operator", "holds", epoch=2), lease)


def test_a_viewer_sees_what_is_remembered_and_changes_none_of_it():
    viewer = browser_of("viewer")
    assert request_refusal(viewer, MemoryRequest(picture=3), ENGLISH) == ""
    assert request_refusal(viewer, MemoryNoteRequest(instance_id=3, name="mine"), ENGLISH)


def test_a_viewer_may_stop_and_command_nothing_else():
    viewer = browser_of("viewer")
    assert not may_command(viewer)
    assert request_refusal(viewer, ControlRequest(action="stop"), ENGLISH) == ""
    assert "can watch and stop the robot" in request_refusal(
        viewer, ControlRequest(action="pause"), ENGLISH
    )
    assert "not command it" in request_refusal(viewer, FeedbackRequest(verdict="confirm"), ENGLISH)
    assert request_refusal(browser_of("operator"), ControlRequest(action="pause"), ENGLISH) == ""


def test_only_a_supervisor_takes_control():
    assert take_refusal(browser_of("supervisor"), ENGLISH) == ""
    assert "your login (operator) cannot take control" in take_refusal(
        browser_of("operator"), ENGLISH
    )


def test_messages_to_viser_by_permission():
    browser = browser_of("operator")
    browser.own_controls.add("mine")
    assert may_send(browser, "ViewerCameraMessage", "", panels=False)
    assert not may_send(browser, "GuiUpdateMessage", "other", panels=False)
    assert may_send(browser, "GuiUpdateMessage", "mine", panels=False)
    assert not may_send(browser, "SceneNodeClickMessage", "mine", panels=False)
    assert may_send(browser, "GuiUpdateMessage", "other", panels=True)
    assert not may_send(browser, "ShareUrlRequest", "", panels=True)
