"""What a browser may do, by the role of its login and by who has control of the robot.

The navigator checks the lease of every command again; these rules keep a browser from sending it.
"""

from typing import Final

import msgspec

from app.messages.control import is_stop
from app.messages.lease import LeaseStatus
from app.messages.memory import MemoryRequest
from app.nodes.console.web.browsers import Browser
from app.view.words import Words

VIEW_MESSAGES: Final = frozenset(
    {"ViewerCameraMessage", "GetRenderResponseMessage", "LocalStorageGetItemResponseMessage"}
)
"""Messages of viser's client that every browser may send."""
PANEL_MESSAGES: Final = frozenset(
    {
        "CommandTriggerMessage",
        "GuiButtonHoldMessage",
        "GuiFormDirtyMessage",
        "GuiFormSubmitMessage",
        "GuiUpdateMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "ScenePointerMessage",
        "TransformControlsDragEndMessage",
        "TransformControlsDragStartMessage",
        "TransformControlsUpdateMessage",
    }
)
"""Messages of browsers that may use the panels. All others, such as uploads and public tunnels, are
refused."""


def may_command(browser: Browser) -> bool:
    """Return whether the login allows more than to watch and to stop the robot."""
    return browser.role != "viewer"


def may_use_panels(browser: Browser, lease: LeaseStatus) -> bool:
    """Return whether a browser may use the panels: no other browser has control."""
    holds = browser.standing == "holds" and lease.epoch <= browser.epoch
    return may_command(browser) and (lease.state == "free" or holds)


def may_send(browser: Browser, message_type: str, control_uuid: str, *, panels: bool) -> bool:
    """Return whether a browser may send a message to viser.

    Args:
        browser: The sender.
        message_type: Type of viser's message.
        control_uuid: Control of the panels that it changes; empty for none.
        panels: Whether the browser may use the panels now.
    """
    if message_type in VIEW_MESSAGES:
        return True
    if message_type not in PANEL_MESSAGES:
        return False
    return panels or (message_type == "GuiUpdateMessage" and control_uuid in browser.own_controls)


def request_refusal(browser: Browser, request: msgspec.Struct, say: Words) -> str:
    """Return why a browser may not send a request, empty when it may.

    Everyone may stop the robot, and see what it remembers.
    """
    if may_command(browser) or is_stop(request) or isinstance(request, MemoryRequest):
        return ""
    return say("refusal.viewer")


def take_refusal(browser: Browser, say: Words) -> str:
    """Return why a browser may not take control from its holder, empty when it may."""
    if browser.role == "supervisor":
        return ""
    return say("refusal.take", role=say(f"role.{browser.role}"))
