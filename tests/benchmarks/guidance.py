"""How long common sense takes: the embedded prior, an answer kept on disk, and sentences.

Sentences are also compared with what they mean.
"""

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from app.links.language_model.answer_cache import AnswerCache, CachedAnswer
from app.links.language_model.chat import ChatConfig
from app.links.language_model.language_model import LanguageModel
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.language.requests.sentence import read_request
from ippon.guidance.prior import EmbeddedPrior
from ippon.guidance.prompts.level_prompt import build_prompt
from ippon.vocabulary import LABORATORY_40, MATTERPORT_40
from tests.benchmarks.rows import Row
from tests.ippon.guidance.language.requests.expected_requests import differences, load_cases
from tests.locations import ROOT

REPEATS = 200
SENTENCES = ROOT / "tests/ippon/guidance/language/requests"
NOBODY = "http://127.0.0.1:9/v1"
"""Nobody answers there: what comes is from the disk."""
CONTEXT = "I think I left it on the sofa yesterday"


def guidance_rows() -> Iterator[Row]:
    """Measure each on warm tables."""
    prior = EmbeddedPrior()
    prior.warm_up()
    for name, context, labels, what in (
        ("bed", "", MATTERPORT_40, "bed, 40 labels of Matterport"),
        ("hat", CONTEXT, MATTERPORT_40, "hat with context, 40 labels of Matterport"),
        ("hat", CONTEXT, LABORATORY_40, "hat with context, 40 labels of the laboratory"),
    ):
        resolved = resolve_object(name, labels)
        yield _row(
            "levels, embedded prior",
            what,
            lambda r=resolved, c=context, v=labels: prior.levels(r, c, v),
        )
    with tempfile.TemporaryDirectory() as folder:
        yield from _cached(prior, Path(folder))
    yield _row(
        "one sentence, by rules",
        "find my hat, I think I left it on the sofa",
        lambda: read_request("find my hat, I think I left it on the sofa"),
    )
    yield from sentence_rows()


def sentence_rows() -> Iterator[Row]:
    """Read the sentences of the tests: how many are right, and how long one takes."""
    times: list[float] = []
    for path in sorted(SENTENCES.glob("sentences*.yaml")):
        cases = load_cases(path.name)
        right = unmarked = 0
        for case in cases:
            started = time.process_time()
            request = read_request(case.sentence)
            times.append(1e3 * (time.process_time() - started))
            same = not differences(case, request)
            right += same
            unmarked += not (same or request.doubtful or request.unused)
        name = path.stem.removeprefix("sentences").removeprefix("_") or "first"
        data = f"{name} set, {len(cases)} sentences"
        yield Row(name="read right", data=data, value=100.0 * right / len(cases), unit="%")
        yield Row(name="read wrongly, without a mark", data=data, value=unmarked)
    data = f"{len(times)} sentences of the tests"
    yield Row(name="one sentence, by rules", data=data, median_ms=statistics.median(times))


def _cached(prior: EmbeddedPrior, folder: Path) -> Iterator[Row]:
    config = ChatConfig(base_url=NOBODY, model="any")
    rows = prior.levels("hat", CONTEXT, MATTERPORT_40).rows
    question = build_prompt("hat", CONTEXT, "", MATTERPORT_40)
    cache = AnswerCache(folder, endpoint=NOBODY, model="any")
    cache.store(question, CachedAnswer(rows=rows, prompt=question, reply="kept"))
    model = LanguageModel(config, cache_dir=folder, prior=prior)

    def ask() -> None:
        assert model.levels("hat", CONTEXT, MATTERPORT_40).from_cache

    yield _row("levels, kept answer of a model", "hat with context", ask)
    model.close()


def _row(name: str, data: str, run: Callable[[], object]) -> Row:
    run()
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        run()
        times.append(1e3 * (time.perf_counter() - started))
    return Row(name=name, data=data, median_ms=statistics.median(times))
