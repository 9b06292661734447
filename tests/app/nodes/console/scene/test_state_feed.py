import asyncio
import threading

from app.nodes.console.scene import state_feed as bulletin_module
from app.nodes.console.scene.state_feed import STALLED, StateFeed


def test_a_reader_gets_the_current_notice_at_once_and_then_the_newest():
    async def read():
        state_feed = StateFeed()
        state_feed.post(b"1")
        notices = state_feed.follow()
        first = await anext(notices)
        for n in range(2, 50):
            state_feed.post(str(n).encode())
        newest = await anext(notices)
        await notices.aclose()
        return first, newest

    assert asyncio.run(read()) == (b"1", b"49")


def test_posts_from_another_thread_arrive():
    async def read():
        state_feed = StateFeed()
        notices = state_feed.follow()
        waiting = asyncio.ensure_future(anext(notices))
        await asyncio.sleep(0)
        thread = threading.Thread(target=state_feed.post, args=(b"hello",))
        thread.start()
        notice = await asyncio.wait_for(waiting, 5.0)
        thread.join()
        await notices.aclose()
        return notice

    assert asyncio.run(read()) == b"hello"


def test_the_same_notice_wakes_nobody():
    async def read():
        state_feed = StateFeed()
        state_feed.post(b"same")
        notices = state_feed.follow()
        await anext(notices)
        state_feed.post(b"same")
        waiting = asyncio.ensure_future(anext(notices))
        done, _ = await asyncio.wait([waiting], timeout=0.05)
        state_feed.post(b"other")
        return bool(done), await asyncio.wait_for(waiting, 5.0)

    assert asyncio.run(read()) == (False, b"other")


def test_readers_that_leave_are_forgotten():
    async def read():
        state_feed = StateFeed()
        state_feed.post(b"1")
        notices = state_feed.follow()
        await anext(notices)
        await notices.aclose()
        return len(state_feed._readers)

    assert asyncio.run(read()) == 0


def test_who_stops_posting_is_said_to_have_stalled_and_to_be_back(monkeypatch):
    monkeypatch.setattr(bulletin_module, "STALLED_S", 0.1)
    monkeypatch.setattr(bulletin_module, "_LOOK_S", 0.02)

    async def read():
        state_feed = StateFeed()
        state_feed.post(b"1")
        notices = state_feed.follow()
        seen = [await anext(notices), await anext(notices)]
        assert state_feed.is_stalled
        monkeypatch.setattr(bulletin_module, "STALLED_S", 60.0)
        state_feed.post(b"1")
        seen.append(await anext(notices))
        await notices.aclose()
        return seen

    assert asyncio.run(read()) == [b"1", STALLED, b"1"]


def test_who_comes_after_the_posts_have_stopped_hears_the_last_one_first(monkeypatch):
    monkeypatch.setattr(bulletin_module, "STALLED_S", 0.0)

    async def read():
        state_feed = StateFeed()
        state_feed.post(b"1")
        notices = state_feed.follow()
        seen = [await anext(notices), await anext(notices)]
        await notices.aclose()
        return seen

    assert asyncio.run(read()) == [b"1", STALLED]
