"""WebSocket of the shell: state out, commands in, and pings for the latency."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable
from typing import Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.messages.control import ControlRequest
from app.messages.plain_text import as_sentence
from app.nodes.console.link.commands import CommandError, Controller, act_at
from app.nodes.console.link.input_age import LATE_S, InputAge
from app.nodes.console.scene.scene_requests import Hover, Look
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web.browsers import Browser, acting_browser, set_acting_browser
from app.nodes.console.web.page_messages import (
    ShellAlive,
    ShellCommand,
    ShellDrive,
    ShellFrame,
    ShellHover,
    ShellInput,
    ShellLate,
    ShellLease,
    ShellLook,
    ShellMessage,
    ShellNote,
    ShellPing,
    ShellPoint,
    ShellPong,
    ShellQueue,
    ShellReply,
    ShellRoom,
    ShellSaved,
    ShellSearch,
    ShellTheme,
    ShellVerdict,
    ShellYou,
    page_messages,
    until_one_ends,
)
from app.nodes.console.web.permissions import may_command
from ippon.control.drive_mode import NO_INPUT, TeleopInput

logger = logging.getLogger(__name__)

MAX_MESSAGE: Final = 8192
RENEW_S: Final = 0.5
ASLEEP_S: Final = 5.0
"""Silence after which a page counts as asleep and its lease is no longer renewed; longer than the
pauses of a page that renders slowly. A closed page is noticed at once."""

_decoder: Final = msgspec.json.Decoder(ShellMessage)


async def serve_shell(
    socket: WebSocket, state_feed: StateFeed, controller: Controller, browser: Browser, edition: str
) -> None:
    """Serve one shell until its browser disconnects; `edition` is that of `Assets`."""
    set_acting_browser(browser)
    await socket.accept()
    outbox: asyncio.Queue[bytes] = asyncio.Queue(maxsize=64)
    standing = _Standing(outbox.put, controller, browser, edition)
    await until_one_ends(
        _listen(socket, outbox.put, controller, standing, state_feed),
        standing.keep(),
        _announce(state_feed, outbox.put),
        _send(socket, outbox),
    )


async def _send(socket: WebSocket, outbox: asyncio.Queue[bytes]) -> None:
    try:
        while True:
            await socket.send_text((await outbox.get()).decode())
    except (WebSocketDisconnect, RuntimeError):
        return


async def _announce(state_feed: StateFeed, put: Callable[[bytes], Awaitable[None]]) -> None:
    async for state in state_feed.follow():
        await put(state)


async def _listen(
    socket: WebSocket,
    put: Callable[[bytes], Awaitable[None]],
    controller: Controller,
    standing: "_Standing",
    state_feed: StateFeed,
) -> None:
    commands: set[asyncio.Task[None]] = set()
    hand = _Hand(controller)
    try:
        async for message in page_messages(socket, _decoder, "the shell", MAX_MESSAGE):
            if isinstance(message, ShellAlive):
                standing.hear()
                continue
            if isinstance(message, ShellTheme):
                standing.browser.has_light_theme = message.light
                continue
            if isinstance(message, ShellLook):
                state_feed.scene.look(
                    Look(
                        browser=standing.browser,
                        centre_world=message.position,
                        size_m=message.size,
                        at_once=message.at_once,
                        thing=message.thing,
                        share=message.share,
                    )
                )
                continue
            if isinstance(message, ShellFrame):
                state_feed.scene.frame(standing.browser)
                continue
            if isinstance(message, ShellInput):
                if not hand.move(message):
                    continue
                task = asyncio.create_task(_tell_late(put))
            elif isinstance(message, ShellPing):
                hand.age.ping(message.t, message.trip, time.monotonic())
                # Not awaited: a Stop must be read while the line to the page is full.
                task = asyncio.create_task(_echo(message, put))
            elif isinstance(message, ShellLease):
                task = asyncio.create_task(standing.act(message))
            elif isinstance(message, ShellHover):
                task = asyncio.create_task(_name(message, put, state_feed, standing.browser))
            else:
                task = asyncio.create_task(_command(message, put, controller, state_feed))
            commands.add(task)
            task.add_done_callback(commands.discard)
    finally:
        hand.release()
        # A pending command is completed after a disconnect, because it may be a stop.
        if commands:
            _, late = await asyncio.wait(commands, timeout=5.0)
            for task in late:
                task.cancel()


class _Hand:
    """Keys that a page holds down."""

    def __init__(self, controller: Controller) -> None:
        self.age = InputAge()
        self._controller = controller
        self._held = NO_INPUT
        self._told_s = -LATE_S

    def move(self, message: ShellInput) -> bool:
        """Pass keys on; returns whether the page must be told that they arrive too late."""
        now_s = time.monotonic()
        is_late = self.age.late_s(message.t, now_s) > LATE_S
        held = TeleopInput(forward=message.forward, turn=message.turn, tilt=message.tilt)
        # Keys that were held so long ago may be up.
        self._held = NO_INPUT if is_late else held
        self._controller.send_input(self._held)
        if not is_late or now_s - self._told_s < LATE_S:
            return False
        self._told_s = now_s
        return True

    def release(self) -> None:
        """Release what is held, as when the browser disconnects with a key held down."""
        if self._held != NO_INPUT:
            self._controller.send_input(NO_INPUT)


class _Standing:
    """Lease of one page, renewed while the page is awake."""

    def __init__(
        self,
        put: Callable[[bytes], Awaitable[None]],
        controller: Controller,
        browser: Browser,
        edition: str,
    ) -> None:
        self._edition = edition
        self._put = put
        self._controller = controller
        self.browser = browser
        self._told: ShellYou | None = None
        self._is_new = True
        self._heard_s = time.monotonic()

    def hear(self) -> None:
        """Note that the page is awake."""
        self._heard_s = time.monotonic()

    async def keep(self) -> None:
        """Renew the lease or the pending request; for a new page, check whether there is one."""
        while True:
            is_awake = time.monotonic() - self._heard_s < ASLEEP_S
            if is_awake and (self.browser.has_lease_or_request or self._is_new):
                await self._renew()
            await self.tell()
            await asyncio.sleep(RENEW_S)

    async def _renew(self) -> None:
        try:
            if may_command(self.browser):
                await self._controller.lease("renew")
            self._is_new = False
        except CommandError as error:
            logger.debug("no renewal: %s", error)

    async def act(self, message: ShellLease) -> None:
        """Carry out a command of a button."""
        try:
            answer = await self._controller.lease(message.action, message.requester)
            # A request beside that of somebody else is no error, and changes nothing.
            ok = message.action != "request" or answer.standing in ("holds", "waits")
            reply = ShellReply(id=message.id, ok=ok, text=answer.detail)
        except CommandError as error:
            reply = ShellReply(id=message.id, ok=False, text=str(error))
        await self._put(msgspec.json.encode(reply))
        await self.tell()

    async def tell(self) -> None:
        """Send the standing to the page if it changed."""
        browser = self.browser
        you = ShellYou(
            name=browser.name,
            role=browser.role,
            standing=browser.standing,
            detail=browser.detail,
            has_login=browser.expires_s is not None,
            edition=self._edition,
        )
        if you != self._told:
            self._told = you
            await self._put(msgspec.json.encode(you))


_Command = (
    ShellCommand | ShellDrive | ShellRoom | ShellSearch | ShellNote | ShellQueue | ShellSaved
    | ShellVerdict | ShellPoint
)  # fmt: skip


async def _echo(message: ShellPing, put: Callable[[bytes], Awaitable[None]]) -> None:
    await put(msgspec.json.encode(ShellPong(t=message.t)))


async def _tell_late(put: Callable[[bytes], Awaitable[None]]) -> None:
    await put(msgspec.json.encode(ShellLate()))


async def _name(
    message: ShellHover,
    put: Callable[[bytes], Awaitable[None]],
    state_feed: StateFeed,
    browser: Browser,
) -> None:
    hover = Hover(browser=browser, u=message.u, v=message.v)
    text = await state_feed.scene.name_under(hover)
    await put(msgspec.json.encode(ShellReply(id=message.id, ok=True, text=text)))


async def _command(
    command: _Command,
    put: Callable[[bytes], Awaitable[None]],
    controller: Controller,
    state_feed: StateFeed,
) -> None:
    try:
        text = await _carried_out(command, controller, state_feed)
        reply = ShellReply(id=command.id, ok=True, text=text)
    except CommandError as error:
        reply = ShellReply(id=command.id, ok=False, text=str(error))
    await put(msgspec.json.encode(reply))


async def _clicked(x_m: float, y_m: float, controller: Controller, state_feed: StateFeed) -> str:
    browser = acting_browser()
    choice = None if browser is None else await state_feed.scene.click_choice(browser)
    if choice is None or choice.tool == "explain":
        # The page says what to choose.
        raise CommandError("")
    done = await asyncio.to_thread(act_at, controller, choice.tool, x_m, y_m, choice.brush_m)
    return as_sentence(done)


async def _carried_out(command: _Command, controller: Controller, state_feed: StateFeed) -> str:
    match command:
        case ShellDrive():
            return await controller.drive(command.mode)
        case ShellRoom(x_m=x_m, y_m=y_m, name=name):
            text = await asyncio.to_thread(controller.name_room, x_m, y_m, name)
            state_feed.exports.names_changed()
            return text
        case ShellSearch():
            return await asyncio.to_thread(controller.search_for, command.object)
        case ShellVerdict(verdict=verdict, goal_id=goal_id, find=number):
            is_it = verdict == "confirm"
            judge = controller.confirm_find if is_it else controller.reject_find
            return await asyncio.to_thread(judge, goal_id, number)
        case ShellNote():
            text = await asyncio.to_thread(controller.note_thing, command.change)
            state_feed.exports.names_changed()
            return text
        case ShellPoint(x_m=x_m, y_m=y_m):
            return await _clicked(x_m, y_m, controller, state_feed)
        case ShellQueue():
            return await asyncio.to_thread(controller.change_queue, command.change)
        case ShellSaved():
            return await asyncio.to_thread(controller.change_saved, command.change)
        case ShellCommand(action=action, goal_id=goal_id):
            request = ControlRequest(action=action, requester="console", goal_id=goal_id)
            return await controller.control(request)
