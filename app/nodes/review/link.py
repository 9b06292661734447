"""Link of a review, which has no navigator: it answers no query and refuses every command."""

from typing import Any, NoReturn

from app.links.network.inbox import Inbox
from app.messages.lease import LeaseStatus
from app.messages.status import Status
from app.nodes.console.critical_thread import OnFailure
from app.nodes.console.link.commands import CommandError
from app.nodes.console.link.navigator_link import NavigatorLink
from app.view.words import ENGLISH, Words


class RecordedLink(NavigatorLink):
    """A link without a network; the playback fills the inbox."""

    recorded = True

    def __init__(self, inbox: Inbox, on_failure: OnFailure, say: Words = ENGLISH) -> None:
        super().__init__("the recording", "recorded", (), inbox, on_failure, say)

    def start(self) -> None:
        """Do nothing: there is no network."""

    def close(self) -> None:
        """Do nothing: there is no network."""

    @property
    def is_open(self) -> bool:
        """Return False, so that missing topics are not requested."""
        return False

    def silence_s(self) -> float:
        """Return 0, because a paused recording is not a silent navigator."""
        return 0.0

    def query(self, topic: str) -> bytes | None:  # noqa: ARG002
        """Return None, because there is no navigator."""
        return None

    def lease_in(self, status: Status) -> LeaseStatus:  # noqa: ARG002
        """Return a free lease, so that every browser may use the panels."""
        return LeaseStatus()

    def _request(self, *_: Any, **__: Any) -> NoReturn:
        raise CommandError(self.say("refusal.recorded"))
