"""`ippon console`: the operator's page."""

from app.cli.options.commands import Console
from app.errors import UsageError
from app.nodes.console.node import ConsoleConfig, ConsoleError, run_console
from app.process.parent_watch import end_with_parent


def run_console_command(command: Console) -> int:
    """Serve the page until the process is stopped."""
    end_with_parent(command.parent_pid)
    try:
        run_console(
            ConsoleConfig(
                connect=command.connect,
                robot=command.robot,
                host=command.host,
                port=command.port,
                users=command.users,
                tls_certificate=command.tls_cert,
                tls_key=command.tls_key,
                names=command.names,
            )
        )
    except ConsoleError as error:
        raise UsageError(str(error)) from error
    return 0
