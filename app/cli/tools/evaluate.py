"""`ippon eval`: imports only what the subcommand needs."""

from app.cli.options.evaluation import EvalHabitat, EvalReplay, EvalReport, EvalRun


def run_eval(command: EvalRun | EvalReport | EvalReplay | EvalHabitat) -> int:
    """Run one subcommand and return its exit status."""
    match command:
        case EvalRun():
            from app.evaluation.run import run_evaluation

            return run_evaluation(command)
        case EvalReport():
            from app.evaluation.report import run_report

            return run_report(command)
        case EvalReplay():
            from app.evaluation.replay import run_replay

            return run_replay(command)
        case EvalHabitat():
            from app.evaluation.habitat_run import run_habitat

            return run_habitat(command)
