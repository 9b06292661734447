import asyncio
import time

from app.messages.lease import LeaseReply
from app.nodes.console.web.browsers import Browsers


def test_a_browser_has_its_own_standing_at_each_robot_and_one_login():
    first, second = Browsers(), Browsers()
    browser = first.get_or_add("s" * 32, "Anna", "operator")
    browser.expires_s = 5.0
    twin = browser.twin(second)
    assert (twin.session, twin.name, twin.role, twin.expires_s) == (
        browser.session, "Anna", "operator", 5.0,
    )  # fmt: skip
    assert browser.twin(second) is twin
    twin.update_lease(LeaseReply(standing="holds", epoch=4, detail=""))
    assert (browser.standing, browser.epoch) == ("watches", 0)

    async def look_until_logout():
        with twin.present():
            await asyncio.sleep(60.0)

    async def log_out():
        looking = asyncio.create_task(look_until_logout())
        await asyncio.sleep(0)
        browser.disconnect()
        await asyncio.wait_for(looking, 10.0)

    asyncio.run(log_out())


def test_what_serves_a_browser_since_a_time_goes_on_and_another_cancellation_is_one():
    browser = Browsers().get_or_add("s" * 32)

    async def serve():
        with browser.present():
            await asyncio.sleep(60.0)

    async def leave_a_line():
        old = asyncio.create_task(serve())
        await asyncio.sleep(0)
        left_s = time.monotonic()
        new = asyncio.create_task(serve())
        await asyncio.sleep(0)
        browser.disconnect(began_before_s=left_s)
        await asyncio.wait_for(old, 10.0)
        assert not new.done()
        new.cancel()
        await asyncio.gather(new, return_exceptions=True)
        return new.cancelled()

    assert asyncio.run(leave_a_line())
