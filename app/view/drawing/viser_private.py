"""All uses of viser's private interface, in one file for upgrades.

Each of them has a test.
"""

import asyncio
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import copy_context
from http import HTTPStatus
from typing import Any, Final

import viser
import websockets.asyncio.server as websocket_server
from viser._messages import ShareUrlDisconnect, ShareUrlRequest
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer
from websockets import Headers
from websockets.http11 import Request, Response

SECRET_HEADER: Final = "X-Ippon-Backend"  # noqa: S105 (a name, not a secret)

WHOLE: Final = 65_536
"""Messages that are sent to a browser as one."""

_patching = threading.Lock()


def show_jpeg_in_frustum(frustum: Any, jpeg: bytes) -> None:
    """Show a received JPEG; the public setter would decode and encode it again."""
    frustum._format = "jpeg"  # noqa: SLF001
    frustum._image_data = jpeg  # noqa: SLF001


def show_jpeg_in_panel(image: Any, jpeg: bytes) -> None:
    """Show a received JPEG in an image of a panel."""
    image._format = "jpeg"  # noqa: SLF001
    image._data = jpeg  # noqa: SLF001


class _WokenInLoop(asyncio.Event):
    """An event that only its loop sets.

    viser's `push` sets it in the pushing thread and once more through the loop; the first changes
    what the loop iterates over, which fails when a browser connects at that moment.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._home = loop

    def set(self) -> None:
        try:
            is_home = asyncio.get_running_loop() is self._home
        except RuntimeError:
            return
        if is_home:
            super().set()


class ThreadSafeBuffer(AsyncMessageBuffer):
    """A buffer of messages that any thread may push to while browsers come and go."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.message_event = _WokenInLoop(self.event_loop)


def push_from_any_thread() -> None:
    """Give viser servers that are created afterwards buffers that any thread may push to."""
    _infra.AsyncMessageBuffer = ThreadSafeBuffer  # pyright: ignore[reportPrivateImportUsage]


def disable_sharing(server: viser.ViserServer) -> None:
    """Refuse public tunnels, which any client could request from viser."""
    for message in (ShareUrlRequest, ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)  # noqa: SLF001


def propagate_context(server: viser.ViserServer) -> None:
    """Run callbacks in viser's threads with the context variables of their connection."""
    executor = server._thread_executor  # noqa: SLF001
    submit = executor.submit

    def submit_in_context(call: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Any:
        return submit(copy_context().run, call, *args, **kwargs)

    executor.submit = submit_in_context  # pyright: ignore[reportAttributeAccessIssue]


@contextmanager
def ignore_disconnect(client: viser.ClientHandle) -> Generator[None]:
    """Ignore errors of drawing for a browser that disconnects meanwhile."""
    with client._websock_connection.get_message_buffer().sanctioned_dead_writes():  # noqa: SLF001
        yield


def send_whole_changes(client: viser.ClientHandle) -> None:
    """Send all messages of an atomic block for one browser together, not 128 at a time."""
    client._websock_connection.get_message_buffer().max_window_size = WHOLE  # noqa: SLF001


def uuid_of(handle: Any) -> str:
    """Return the identifier of a panel's control in messages."""
    return handle._impl.uuid  # noqa: SLF001


@contextmanager
def require_secret(
    secret: str, admit: Callable[[Headers], None] = lambda _: None
) -> Generator[None]:
    """Make viser servers created in this context refuse requests without the secret.

    Args:
        secret: Value of the header.
        admit: Called in the task of each accepted connection with its headers; context variables
            that it sets apply to the connection's messages.
    """

    def guard(original: Callable[..., Any] | None) -> Callable[..., Any]:
        def check(connection: Any, request: Request) -> Any:
            if request.headers.get_all(SECRET_HEADER) != [secret]:
                return Response(
                    HTTPStatus.FORBIDDEN,
                    "Forbidden",
                    Headers({"Content-Length": "10", "Connection": "close"}),
                    b"forbidden\n",
                )
            admit(request.headers)
            return None if original is None else original(connection, request)

        return check

    serve = websocket_server.serve

    def guarded(*args: Any, **kwargs: Any) -> Any:
        kwargs["process_request"] = guard(kwargs.get("process_request"))
        return serve(*args, **kwargs)

    with _patching:
        websocket_server.serve = guarded  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield
        finally:
            websocket_server.serve = serve  # pyright: ignore[reportAttributeAccessIssue]
