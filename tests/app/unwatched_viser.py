"""A viser server that nobody watches."""

import contextlib
import io
from collections.abc import Iterator

import viser


@contextlib.contextmanager
def unwatched_viser() -> Iterator[viser.ViserServer]:
    """Run a server on a free port of this machine; what viser prints is swallowed."""
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        yield server
        server.stop()
