"""Messages that threads of the console push to viser's loop."""

import asyncio
import threading
from collections import deque

from viser import _messages
from viser.infra import _infra

from app.view.drawing.viser_private import push_from_any_thread


class LoopsOwn(deque):
    """Fails where another thread than the one that made it iterates over it."""

    def __init__(self):
        super().__init__()
        self._owner = threading.get_ident()

    def __iter__(self):
        assert threading.get_ident() == self._owner, "iterated over by another thread"
        return super().__iter__()


def test_a_push_from_a_thread_wakes_the_loop_and_leaves_its_waiters_to_it(monkeypatch):
    monkeypatch.setattr(_infra, "AsyncMessageBuffer", _infra.AsyncMessageBuffer)
    push_from_any_thread()

    async def receive():
        buffer = _infra.AsyncMessageBuffer(asyncio.get_running_loop(), persistent_messages=True)
        buffer.message_event._waiters = LoopsOwn()
        messages = buffer.window_generator(client_id=1)
        first = asyncio.ensure_future(anext(messages))
        while not buffer.message_event._waiters:
            await asyncio.sleep(0)
        message = _messages.RemoveSceneNodeMessage("/thing")
        await asyncio.to_thread(buffer.push, message)
        window = await asyncio.wait_for(first, 10)
        await messages.aclose()
        return list(window), message

    received, sent = asyncio.run(receive())
    assert received == [sent]
