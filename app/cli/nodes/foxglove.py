"""`ippon foxglove`: a running robot, served to Foxglove."""

import logging

from app.cli.options.viewers import Foxglove
from app.errors import UsageError
from app.links.network.registry import resolve_address
from app.process.parent_watch import end_with_parent

logger = logging.getLogger(__name__)


def run_foxglove_command(command: Foxglove) -> int:
    """Serve until the process is stopped, or write the layout."""
    end_with_parent(command.parent_pid)
    try:
        from app.nodes.viewers.errors import ViewerError
        from app.nodes.viewers.foxglove_layout import layout_json
        from app.nodes.viewers.foxglove_server import FoxgloveConfig, run_foxglove
    except ModuleNotFoundError as error:
        if error.name is None or not error.name.startswith("foxglove"):
            raise
        raise UsageError('Foxglove needs foxglove-sdk: pip install "ippon[foxglove]"') from error

    if command.layout is not None:
        try:
            command.layout.write_text(layout_json() + "\n", "utf-8")
        except OSError as error:
            raise UsageError(f"{command.layout} cannot be written: {error.strerror}") from error
        print(f"{command.layout}: in Foxglove, Layouts, Import from file")
        return 0
    connect, robot = resolve_address(command.connect, command.robot)
    try:
        run_foxglove(
            FoxgloveConfig(
                connect=connect,
                robot=robot,
                host=command.host,
                port=command.port,
                ceiling_m=command.ceiling_m,
            )
        )
    except (ValueError, ViewerError) as error:
        raise UsageError(str(error)) from error
    return 0
