"""Reads from the code what the navigator may say to an operator, as templates with `{}`."""

import ast
import itertools
import re
from collections.abc import Iterator
from pathlib import Path


def templates(path: Path) -> Iterator[tuple[int, str]]:
    """Yield line and template of every text of a module, but not of its docstrings and log.

    A choice between two constants inside an f-string gives one template for each of them. Texts
    inside the values of an f-string come as templates of their own.
    """
    yield from _of(ast.parse(path.read_text()))


def reads_like_text(template: str) -> bool:
    """Whether a template holds two words that follow each other, or one beside a value."""
    plain = re.sub(r"\{\}", "\0", template)
    return bool(re.search(r"[A-Za-z]{2,}['’]?[,:;]? [\0(“a-zA-Z]{1}|\0[^\0]? ?[a-z]{3,}", plain))


def _of(node: ast.AST) -> Iterator[tuple[int, str]]:
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return
    if isinstance(node, ast.FunctionDef) and node.name == "__post_init__":
        return
    if isinstance(node, ast.Assert) or (isinstance(node, ast.Call) and _is_log(node.func)):
        return
    if isinstance(node, ast.JoinedStr):
        for text in _expanded(node):
            yield node.lineno, text
        for value in node.values:
            if isinstance(value, ast.FormattedValue) and not _is_choice(value.value):
                yield from _of(value.value)
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.lineno, re.sub(r"\{\w+\}", "{}", node.value)
        return
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _of(child)


def _is_log(called: ast.expr) -> bool:
    return (
        isinstance(called, ast.Attribute)
        and isinstance(called.value, ast.Name)
        and called.value.id == "logger"
    )


def _is_choice(value: ast.expr) -> bool:
    return isinstance(value, ast.IfExp) and all(
        isinstance(one, ast.Constant) for one in (value.body, value.orelse)
    )


def _expanded(joined: ast.JoinedStr) -> list[str]:
    parts: list[list[str]] = []
    for value in joined.values:
        if isinstance(value, ast.Constant):
            parts.append([str(value.value)])
        elif isinstance(value, ast.FormattedValue) and _is_choice(value.value):
            choice = value.value
            assert isinstance(choice, ast.IfExp)
            parts.append([one.value for one in (choice.body, choice.orelse)])  # pyright: ignore
        else:
            parts.append(["{}"])
    return ["".join(one) for one in itertools.product(*parts)]
