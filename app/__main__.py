"""`ippon`, also `python -m app`."""

import errno
import os
import select
import sys

from app.cli.exit_status import EXIT_FAILED
from app.cli.main import run

EXIT_PIPE_CLOSED = 141
"""Exit status that a shell reports for a program ended by SIGPIPE."""


def main() -> None:
    """Run the command line and end with its exit status."""
    try:
        try:
            status = run(sys.argv[1:])
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        if not _reader_is_gone():
            raise
        # The reader has closed the pipe (`ippon ... | head`).
        _discard_output()
        status = EXIT_PIPE_CLOSED
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        _discard_output()
        sys.stderr.write("ippon: no space is left on the disk that it writes to\n")
        status = EXIT_FAILED
    sys.exit(status)


def _discard_output() -> None:
    """Let Python's last flush of standard output succeed."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _reader_is_gone() -> bool:
    poll = select.poll()
    poll.register(sys.stdout.fileno(), 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


if __name__ == "__main__":
    main()
