"""The client that the reference of the messages shows, against a real navigator."""

import re

import pytest

from tests.locations import ROOT

REFERENCE = ROOT / "docs" / "reference" / "messages.md"


class EnoughError(Exception):
    """The state was printed: the client would go on for ever."""


@pytest.mark.slow
def test_the_client_of_the_reference_asks_and_follows(robot, free_endpoint):
    (code,) = re.findall(r"```python\n(.*?)```", REFERENCE.read_text("utf-8"), re.DOTALL)
    code = code.replace("tcp/127.0.0.1:7447", free_endpoint).replace('"ippon/', '"r/')
    told = []

    def show(what):
        told.append(what)
        if isinstance(what, str):
            raise EnoughError

    names = {"print": show}
    try:
        with robot.sending(), pytest.raises(EnoughError):
            exec(code, names)
    finally:
        names["session"].close()
    accepted, state = told
    assert accepted["object"] == "mug"
    assert state in ("looking_around", "searching")
    status = robot.send_until(lambda s: s.queue or s.goal.object == "mug")
    asked = status.queue[0] if status.queue else status.goal
    assert (asked.display, asked.context) == ("red mug", "I think it is in the kitchen")
