"""Coroutines that serve one socket side by side."""

import asyncio

import pytest
from starlette.websockets import WebSocketDisconnect

from app.nodes.console.web.page_messages import until_one_ends


async def _forever():
    await asyncio.Event().wait()


async def _fail(error):
    await asyncio.sleep(0)
    raise error


def test_the_first_end_ends_the_others():
    ended = []

    async def other():
        try:
            await _forever()
        finally:
            ended.append("other")

    asyncio.run(until_one_ends(other(), asyncio.sleep(0)))
    assert ended == ["other"]


def test_a_failure_is_raised_and_a_browser_that_is_gone_is_none():
    with pytest.raises(ValueError, match="a bug"):
        asyncio.run(until_one_ends(_forever(), _fail(ValueError("a bug"))))
    asyncio.run(until_one_ends(_forever(), _fail(WebSocketDisconnect())))
