"""`ippon rerun`: a running robot, streamed to Rerun."""

from app.cli.options.viewers import Rerun
from app.errors import UsageError
from app.links.network.registry import resolve_address
from app.process.parent_watch import end_with_parent


def run_rerun_command(command: Rerun) -> int:
    """Stream until the process is stopped."""
    end_with_parent(command.parent_pid)
    try:
        from app.nodes.viewers.errors import ViewerError
        from app.nodes.viewers.rerun_viewer import RerunConfig, run_rerun
    except ModuleNotFoundError as error:
        if error.name is None or not error.name.startswith("rerun"):
            raise
        raise UsageError('Rerun needs rerun-sdk: pip install "ippon[rerun]"') from error

    connect, robot = resolve_address(command.connect, command.robot)
    try:
        run_rerun(
            RerunConfig(
                connect=connect,
                robot=robot,
                url=command.url,
                save=command.save,
                ceiling_m=command.ceiling_m,
            )
        )
    except (ValueError, ViewerError) as error:
        raise UsageError(str(error)) from error
    return 0
