"""`ippon`, also `python -m app`."""

import os
import select
import sys

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
        # The reader has closed the pipe (`ippon ... | head`); Python's last flush must not fail.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = EXIT_PIPE_CLOSED
    sys.exit(status)


def _reader_is_gone() -> bool:
    poll = select.poll()
    poll.register(sys.stdout.fileno(), 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


if __name__ == "__main__":
    main()
