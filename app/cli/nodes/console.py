"""`ippon console`: the operator's page."""

from app.cli.options.nodes import Console
from app.nodes.console.node import run_console
from app.process.parent_watch import end_with_parent


def run_console_command(command: Console) -> int:
    """Serve the page until the process is stopped."""
    end_with_parent(command.parent_pid)
    # Only `ippon demo` starts a console as its child, beside a navigator.
    run_console(command, is_awaited=command.parent_pid is not None)
    return 0
