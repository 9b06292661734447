"""`ippon eval replay`: runs one episode again and records it for `ippon review`."""

import sys

from app.cli.options.evaluation import EvalReplay
from app.evaluation.rerun import rerun_episode


def run_eval_replay(command: EvalReplay) -> int:
    """Run the episode, print whether its row is the same, and the recording's folder."""
    replay = rerun_episode(command.folder, command.episode, command.method, _tell)
    if replay.differences:
        _tell(
            f"not the search of the row: {', '.join(replay.differences)} differ; the row was made "
            f"by {replay.row_version}, this is {replay.version}"
        )
    print(replay.session)
    return 0


def _tell(text: str) -> None:
    print(f"ippon: {text}", file=sys.stderr)
