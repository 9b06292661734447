"""Control of the robot for the time of a few requests, from a program without a page."""

import secrets
from collections.abc import Generator
from contextlib import contextmanager

import msgspec
import zenoh

from app.links.network.requests import ask
from app.messages import keys
from app.messages.lease import Credential, LeaseReply, LeaseRequest, TakeRequest


@contextmanager
def request_credential(
    session: zenoh.Session, robot: str, name: str, timeout_s: float, *, take: bool
) -> Generator[Credential]:
    """Yield what requests carry.

    Args:
        session: An open session.
        robot: Key prefix.
        name: What others read.
        timeout_s: How long to wait for an answer.
        take: Take control from whoever holds it, and release it at the end. Without, requests are
            taken while nobody holds control.

    Raises:
        RequestRefusedError: The navigator says why not.
        LinkError: No reply.
    """
    who = Credential(session=secrets.token_urlsafe(24), name=name)
    if not take:
        yield who
        return
    reply = ask(session, f"{robot}/{keys.LEASE_TAKE}", TakeRequest(), LeaseReply, timeout_s, who)
    who = msgspec.structs.replace(who, epoch=reply.epoch)
    try:
        yield who
    finally:
        release = LeaseRequest(action="release")
        ask(session, f"{robot}/{keys.LEASE}", release, LeaseReply, timeout_s, who)
