"""`ippon eval`: runs the subcommand, importing only what it needs."""

from app.cli.options.evaluation import EvalHabitat, EvalReplay, EvalReport, EvalRun


def run_eval(command: EvalRun | EvalReport | EvalReplay | EvalHabitat) -> int:
    """Run one subcommand and return its exit status."""
    match command:
        case EvalRun():
            from app.cli.evaluation.run import run_eval_run

            return run_eval_run(command)
        case EvalReport():
            from app.cli.evaluation.report import run_eval_report

            return run_eval_report(command)
        case EvalReplay():
            from app.cli.evaluation.replay import run_eval_replay

            return run_eval_replay(command)
        case EvalHabitat():
            from app.cli.evaluation.habitat import run_eval_habitat

            return run_eval_habitat(command)
