"""`ippon levels`: proximity levels of an object, without a robot."""

import os
import time

import msgspec

from app.cli.options.tools import Levels
from app.cli.tools.language_model import make_model
from app.cli.tools.levels_table import as_json, print_levels, print_question, said_by
from app.errors import UsageError
from app.links.language_model.interface import LevelsAnswer
from app.messages.control import SearchRequest
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.vocabulary import LABORATORY_40, MATTERPORT_40


def run_levels(command: Levels) -> int:
    """Print the levels of an object."""
    check_query(command.object, command.context)
    answer = _answer(command)
    guidance = answer.guidance
    rated = [(row.level, row) for row in guidance.rows]
    if command.json:
        told: dict[str, object] = {
            "object": guidance.ooi,
            "context": guidance.context,
            "provider": guidance.provider,
            "elapsed_ms": round(answer.elapsed_ms, 2),
            "from_cache": answer.from_cache,
            "notes": list(guidance.notes),
        }
        if command.show_prompt:
            told |= {"prompt": answer.prompt, "reply": answer.reply}
        print(as_json(told, rated))
        return 0
    source = said_by(guidance.provider, answer.elapsed_ms, from_cache=answer.from_cache)
    print_levels(guidance.ooi, rated, guidance.notes, source)
    if command.show_prompt:
        print_question(answer.prompt, answer.reply)
    return 0


def _answer(command: Levels) -> LevelsAnswer:
    vocabulary = MATTERPORT_40 if command.vocabulary == "matterport" else LABORATORY_40
    model = make_model(command.llm, os.environ)
    try:
        if model is not None:
            scenario = SearchRequest(object="-").scenario
            return model.levels(command.object, command.context, vocabulary, scenario=scenario)
    except ValueError as error:
        raise UsageError(str(error)) from error
    finally:
        if model is not None:
            model.close()
    prior = EmbeddedPrior()
    started = time.perf_counter()
    try:
        resolved = resolve_object(command.object, vocabulary)
    except ValueError as error:
        raise UsageError(str(error)) from error
    guidance = prior.levels(resolved, command.context, vocabulary)
    elapsed_ms = 1e3 * (time.perf_counter() - started)
    return LevelsAnswer(
        guidance=guidance, prompt="", reply="", elapsed_ms=elapsed_ms, from_cache=False, failed=""
    )


def check_query(wanted: str, context: str) -> None:
    """Refuse an object or a context that the navigator would refuse.

    Raises:
        UsageError: It is empty or too long.
    """
    if not wanted.strip():
        raise UsageError('no object given; for example: ippon ask "hat"')
    request = msgspec.json.encode({"object": wanted, "context": context})
    try:
        msgspec.json.decode(request, type=SearchRequest)
    except msgspec.ValidationError as error:
        raise UsageError(
            f"an object is at most 80 and a context at most 2000 characters; yours have "
            f"{len(wanted)} and {len(context)}"
        ) from error
