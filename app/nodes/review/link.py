"""In place of the navigator: a recording answers nothing and is commanded by nobody."""

from typing import Any, NoReturn

from app.messages.lease import LeaseStatus
from app.messages.status import Status
from app.nodes.console.critical_thread import OnFailure
from app.nodes.console.link.commands import CommandError
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.scene.inbox import Inbox

REFUSAL = "this is a recording: nothing here commands a robot"


class RecordedLink(NavigatorLink):
    """A link without a network: the playback fills the inbox, and every command is refused."""

    recorded = True

    def __init__(self, inbox: Inbox, on_failure: OnFailure) -> None:
        super().__init__("the recording", "recorded", (), inbox, on_failure)

    def start(self) -> None:
        """There is nothing to open."""

    def close(self) -> None:
        """There is nothing to close."""

    @property
    def is_open(self) -> bool:
        """There is no one to ask for what is missing."""
        return False

    def silence_s(self) -> float:
        """A recording that stands still is not a navigator that is silent."""
        return 0.0

    def query(self, topic: str, timeout_s: float = 0.0) -> bytes | None:  # noqa: ARG002
        """Nobody answers."""
        return None

    def lease_in(self, status: Status) -> LeaseStatus:  # noqa: ARG002
        """Whoever held control then holds nothing here: everybody may look at everything."""
        return LeaseStatus()

    def _request(self, *_: Any, **__: Any) -> NoReturn:
        raise CommandError(REFUSAL)
