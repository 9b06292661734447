"""`ippon record`: all messages of a robot, into a file."""

from app.cli.options.nodes import Record
from app.errors import UsageError
from app.links.network.registry import resolve_address
from app.links.network.session import LinkError
from app.nodes.recorder import RecorderConfig, run_recorder
from app.process.parent_watch import end_with_parent
from app.recording.session_folder import sessions_folder
from app.recording.writing.limits import RecordingLimits


def run_record(command: Record) -> int:
    """Record until the process is stopped."""
    end_with_parent(command.parent_pid)
    connect, robot = resolve_address(command.connect, command.robot)
    try:
        config = RecorderConfig(
            connect=connect,
            robot=robot,
            root=command.out or sessions_folder(),
            limits=RecordingLimits(max_gb=command.max_gb, min_free_gb=command.min_free_gb),
            sensor_hz=command.sensor_hz,
            wait=command.wait,
        )
    except ValueError as error:
        raise UsageError(str(error)) from error
    try:
        run_recorder(config)
    except LinkError as error:
        raise UsageError(str(error)) from error
    return 0
