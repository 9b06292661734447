"""`ippon ask --confirm` and `--reject`: what somebody says of a find."""

import msgspec
import zenoh

from app.cli.options.tools import Ask
from app.cli.tools.levels_table import printable
from app.errors import UsageError
from app.links.network.request_credential import request_credential
from app.links.network.requests import ask
from app.messages import keys
from app.messages.control import Accepted, FeedbackRequest


def feedback_of(command: Ask) -> FeedbackRequest | None:
    """Return what the command says of a find; None if it asks for a search.

    Raises:
        UsageError: It says two things at once.
    """
    said = command.reject if command.confirm is None else command.confirm
    if said is None:
        if command.goal is not None:
            raise UsageError("--goal goes with --confirm or --reject")
        return None
    if command.confirm is not None and command.reject is not None:
        raise UsageError("a find is confirmed or rejected: give --confirm or --reject, not both")
    others = (command.object, command.context, command.add_label, command.picture)
    if any(others) or command.nearest or command.explain or command.follow:
        raise UsageError(
            "--confirm and --reject are about what was found; search in another command"
        )
    return FeedbackRequest(
        verdict="reject" if command.confirm is None else "confirm",
        goal_id=command.goal,
        find=None if said == "last" else said,
    )


def give_feedback(
    session: zenoh.Session, robot: str, command: Ask, request: FeedbackRequest, name: str
) -> None:
    """Send what is said of a find, and print the answer."""
    limit_s = command.timeout_s
    with request_credential(session, robot, name, limit_s, take=command.take) as who:
        accepted = ask(session, f"{robot}/{keys.FEEDBACK}", request, Accepted, limit_s, who)
    as_json = msgspec.json.encode(accepted).decode()
    print(as_json if command.json else printable(accepted.detail), flush=True)
