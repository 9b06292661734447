"""Sentences with what must be understood, in the notation of `sentences.yaml`."""

import re
from dataclasses import dataclass
from pathlib import Path

import yaml

from ippon.guidance.language.goals.goal import Goal, Request
from ippon.guidance.language.naming import same_object
from ippon.guidance.language.words import singular, singular_candidates

_GOAL = re.compile(
    r"^(?P<object>[^\[\]@{}^~?]*?)\s*(?:\[(?P<attributes>[^\]]*)\])?\s*(?:x(?P<count>\d+|all))?\s*"
    r"(?:\^(?P<reference>\w+))?\s*(?P<relations>(?:@!?[^@{]+)*)(?P<context>(?:\{[^}]*\}\s*)*)$"
)
_RELATIONS = ("next to", "in front of", "between", "behind", "under", "above", "from", "near",
              "on", "in", "at", "by")  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One sentence."""

    sentence: str
    goals: tuple[dict, ...] = ()
    foreign: bool = False
    nothing: bool = False
    doubtful: bool = False
    unused: tuple[str, ...] = ()


def load_cases(name: str = "sentences.yaml") -> list[Case]:
    """Read the cases of a file."""
    file = Path(__file__).parent / name
    groups = yaml.safe_load(file.read_text(encoding="utf-8"))
    lines = [line for text in groups.values() for line in text.splitlines() if "=>" in line]
    return [_case(*(part.strip() for part in line.rsplit("=>", 1))) for line in lines]


def _case(sentence: str, expected: str) -> Case:
    if expected == "!":
        return Case(sentence, foreign=True)
    doubtful = expected.endswith("?")
    expected = expected.removesuffix("?").strip()
    unused = tuple(re.findall(r"~(\w+)", expected))
    expected = re.sub(r"~\w+", "", expected).strip()
    if expected == "-":
        return Case(sentence, nothing=True, doubtful=doubtful, unused=unused)
    parts = re.split(r"\s([|>/])\s", f" {expected}")
    goals = [_goal(parts[0].strip(), "and")]
    for sign, part in zip(parts[1::2], parts[2::2], strict=True):
        goals.append(_goal(part.strip(), {"|": "and", ">": "then", "/": "or"}[sign]))
    return Case(sentence, tuple(goals), doubtful=doubtful, unused=unused)


def _goal(text: str, order: str) -> dict:
    match = _GOAL.match(text)
    assert match, text
    relations = [_relation(part.strip()) for part in match["relations"].split("@") if part.strip()]
    return {
        "object": match["object"].strip(),
        "attributes": _list(match["attributes"]),
        "count": "all" if match["count"] == "all" else int(match["count"] or 1),
        "relations": relations,
        "words": re.findall(r"\{([^}]*)\}", match["context"]),
        "order": order,
        "reference": match["reference"] or "",
    }


def _list(text: str | None) -> list[str]:
    return [part.strip() for part in (text or "").split(",") if part.strip()]


def _relation(text: str) -> tuple[str, str, bool, tuple[str, ...]]:
    negated = text.startswith("!")
    text = text.removeprefix("!")
    attributes = re.search(r"\(([^)]*)\)", text)
    text = re.sub(r"\([^)]*\)", "", text).strip()
    relation = next(name for name in _RELATIONS if text.startswith(name + " "))
    place = text.removeprefix(relation).strip()
    relation = "next to" if relation == "by" else relation
    return relation, place, negated, tuple(_list(attributes[1] if attributes else None))


def differences(case: Case, request: Request) -> list[str]:
    """Return what was not understood as it must be; empty where all was."""
    if case.foreign or case.nothing:
        wrong = [f"object {goal.object!r}" for goal in request.goals]
        wrong += ["not doubtful"] if not request.doubtful else []
        return wrong + (["no language"] if case.foreign and not request.language else [])
    if len(case.goals) != len(request.goals):
        return [f"{len(request.goals)} goals: {[goal.object for goal in request.goals]}"]
    wrong = [
        text
        for number, (want, got) in enumerate(zip(case.goals, request.goals, strict=True))
        for text in _goal_differences(want, got, first=number == 0)
    ]
    if case.doubtful and not request.doubtful:
        wrong.append("not doubtful")
    return wrong + [f"{word} not reported" for word in case.unused
                    if word not in " ".join(request.unused)]  # fmt: skip


def _goal_differences(want: dict, got: Goal, *, first: bool) -> list[str]:
    wrong: list[str] = []
    if not _same(want["object"], got.object):
        wrong.append(f"object {got.object!r}")
    values = [("-" if one.negated else "") + one.value for one in got.attributes]
    if len(values) != len(want["attributes"]) or not all(
        any(_within(value, other) for other in values) for value in want["attributes"]
    ):
        wrong.append(f"attributes {values}")
    if want["count"] != got.count:
        wrong.append(f"count {got.count}")
    relations = {
        (
            one.relation,
            one.place,
            one.negated,
            tuple(("-" if a.negated else "") + a.value for a in one.attributes),
        )
        for one in got.relations
    }
    if len(relations) != len(want["relations"]) or not all(
        any(_same_relation(relation, other) for other in relations)
        for relation in want["relations"]
    ):
        wrong.append(f"relations {relations}")
    wrong += [f"context {got.context!r}" for words in want["words"]
              if words.lower() not in got.context.lower()]  # fmt: skip
    if not first and want["order"] != got.order:
        wrong.append(f"order {got.order}")
    if want["reference"] != got.refers_to:
        wrong.append(f"refers to {got.refers_to!r}")
    return wrong


def _within(value: str, other: str) -> bool:
    return (
        value.startswith("-") == other.startswith("-") and value.strip("-").lower() in other.lower()
    )


def _same(one: str, other: str) -> bool:
    one, other = one.lower(), other.lower()
    singulars = {one, *singular_candidates(one)} & {other, *singular_candidates(other)}
    return bool(singulars) or singular(one) == singular(other) or same_object(one, other)


def _same_relation(one: tuple, other: tuple) -> bool:
    same = one[0] == other[0] and one[2] == other[2] and _same(one[1], other[1])
    return (
        same
        and len(one[3]) == len(other[3])
        and all(any(_within(value, got) for got in other[3]) for value in one[3])
    )
