"""`ippon read`: what is understood of a sentence, without a robot."""

import os
import time

from rich.console import Console
from rich.table import Table
from rich.text import Text

from app.cli.options.tools import Read
from app.cli.tools.language_model import make_model
from app.cli.tools.levels_table import printable
from app.errors import UsageError
from app.links.language_model.interface import RULES, SentenceAnswer
from app.links.language_model.sentence_reading import as_reading
from app.messages.control import SentenceReading, encode
from ippon.guidance.language.goals.goal import Goal
from ippon.guidance.language.requests.sentence import read_request

EXIT_NOTHING = 1
"""No object was found in the sentence."""


def run_read(command: Read) -> int:
    """Print what is understood of a sentence; exit status 1 when no object is."""
    if not command.sentence.strip():
        raise UsageError('no sentence given; for example: ippon read "my keys and the red mug"')
    reading = _reading(command)
    if command.json:
        print(encode(reading).decode())
    else:
        print_reading(reading, Console())
    return 0 if reading.goals else EXIT_NOTHING


def _reading(command: Read) -> SentenceReading:
    previous = read_request(command.previous).goals if command.previous else ()
    started = time.perf_counter()
    model = make_model(command.llm, os.environ)
    if model is None:
        answer = SentenceAnswer(read_request(command.sentence, previous), RULES, "", "", "")
    else:
        try:
            answer = model.read_request(command.sentence, previous)
        finally:
            model.close()
    return as_reading(answer, 1e3 * (time.perf_counter() - started))


def print_reading(reading: SentenceReading, screen: Console) -> None:
    """Print the goals of a sentence as a table, and below it what is doubtful or not used."""
    if reading.goals:
        table = Table(title=f"Read by {printable(reading.provider)}", title_justify="left")
        for heading in ("look for", "how many", "described as", "where", "context"):
            table.add_column(heading)
        for number, goal in enumerate(reading.goals):
            first = f"{goal.order} " if number and goal.order != "and" else ""
            table.add_row(*(Text(printable(cell)) for cell in (
                first + goal.object,
                str(goal.count),
                described(goal),
                where(goal),
                goal.context,
            )))  # fmt: skip
        screen.print(table)
    lines = [("doubtful", reading.because)] if reading.doubtful else []
    lines += [("not used", words) for words in reading.unused]
    lines += [("note", note) for note in reading.notes]
    if reading.note:
        lines.append(("note", f"read by rules: {reading.note}"))
    for kind, text in lines:
        screen.print(Text(f"{kind}: {printable(text)}"), soft_wrap=True)


def described(goal: Goal) -> str:
    """Return the attributes of a goal in one line."""
    words = ", ".join(one.text for one in goal.attributes)
    if goal.refers_to:
        words = ", ".join(part for part in (words, goal.refers_to) if part)
    return words


def where(goal: Goal) -> str:
    """Return the relations of a goal in one line."""
    return ", ".join(one.text for one in goal.relations)
