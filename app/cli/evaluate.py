"""`ippon eval`: imports only what the subcommand needs."""

from app.cli.eval_options import EvalHabitat, EvalReplay, EvalReport, EvalRun


def run_eval(command: EvalRun | EvalReport | EvalReplay | EvalHabitat) -> int:
    """Run one subcommand and return its exit status."""
    match command:
        case EvalRun():
            from app.cli.eval_run import run_evaluation

            return run_evaluation(command)
        case EvalReport():
            from app.cli.eval_report import run_report

            return run_report(command)
        case EvalReplay():
            from app.cli.eval_replay import run_replay

            return run_replay(command)
        case EvalHabitat():
            from app.cli.eval_habitat import run_habitat

            return run_habitat(command)
