"""Credential for the requests of a program, with temporary control of the robot if wanted."""

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
    """Yield the credential that requests carry.

    Args:
        session: An open session.
        robot: Key prefix.
        name: Name of the requester that others see.
        timeout_s: Time to wait for each reply.
        take: Take control from its holder, and release it at the end. Without it, requests are
            accepted only while nobody has control.

    Raises:
        RequestRefusedError: The navigator refused; the text says why.
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
