"""Reads modules without importing them, and writes what is public in them as Markdown."""

import ast
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Final

_SECTION: Final = re.compile(r"^(Args|Returns|Raises|Yields):$")
_FUNCTIONS: Final = (ast.FunctionDef, ast.AsyncFunctionDef)

Statements = list[ast.stmt]


def read_module(path: Path) -> ast.Module:
    """Return the tree of a module."""
    return ast.parse(path.read_text("utf-8"))


def documented_values(body: Statements) -> Iterator[tuple[ast.stmt, str]]:
    """Yield each assignment, and the docstring below it or an empty one."""
    for statement, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            yield statement, _text_of(after)


def classes_of(tree: ast.Module) -> Iterator[ast.ClassDef]:
    """Yield the public classes."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield node


def fields_of(node: ast.ClassDef) -> list[tuple[str, str, str, str]]:
    """Return name, type, default and meaning of each field of a class."""
    rows: list[tuple[str, str, str, str]] = []
    for statement, text in documented_values(node.body):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            name = statement.target.id
            if not name.startswith("_"):
                default = "" if statement.value is None else ast.unparse(statement.value)
                rows.append((name, ast.unparse(statement.annotation), default, text))
    return rows


def field_table(rows: list[tuple[str, str, str, str]]) -> str:
    """Return fields as a Markdown table."""
    if not rows:
        return ""
    cells = [
        (as_code(name), as_code(kind), as_code(default) if default else "", text)
        for name, kind, default, text in rows
    ]
    return table(("field", "type", "default", "meaning"), cells)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *([_cell(cell) for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def as_code(text: str) -> str:
    """Return code for a cell of a table, in which no Markdown escapes a bar."""
    return f"<code>{escape(' '.join(text.split()), quote=False).replace('|', '&#124;')}</code>"


def describe_module(path: Path, name: str) -> str:
    """Return the public part of a module as Markdown, below a heading of the second level."""
    tree = read_module(path)
    parts = [f"## {name}", as_markdown(ast.get_docstring(tree) or "")]
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            parts += _describe_class(node)
        elif isinstance(node, _FUNCTIONS) and not node.name.startswith("_"):
            parts += [f"### {node.name}", _signature(node), _doc(node)]
    return "\n\n".join(part for part in parts if part)


def as_markdown(docstring: str) -> str:
    """Return a docstring in Google's style with its sections as lists."""
    out: list[str] = []
    in_section = False
    for line in docstring.splitlines():
        if _SECTION.match(line):
            in_section = True
            out += ["", f"**{line.removesuffix(':')}**", ""]
        elif in_section and line.startswith("    ") and not line.startswith("     "):
            out.append("- " + re.sub(r"^(\w+): ", r"`\1`: ", line.strip()))
        elif in_section and line.strip():
            out.append("  " + line.strip())
        else:
            in_section = in_section and not line.strip()
            out.append(line)
    return "\n".join(out).strip()


def _describe_class(node: ast.ClassDef) -> list[str]:
    bases = ", ".join(ast.unparse(base) for base in node.bases)
    parts = [f"### {node.name}", f"`class {node.name}({bases})`" if bases else "", _doc(node)]
    parts.append(field_table(fields_of(node)).rstrip())
    for method in node.body:
        if isinstance(method, _FUNCTIONS) and (
            not method.name.startswith("_") or (method.name == "__init__" and _doc(method))
        ):
            parts += [_signature(method), _doc(method)]
    return parts


def _signature(node: ast.FunctionDef | ast.AsyncFunctionDef) -> str:
    returns = f" -> {ast.unparse(node.returns)}" if node.returns is not None else ""
    text = f"{node.name}({ast.unparse(node.args)}){returns}"
    decorators = [ast.unparse(one) for one in node.decorator_list]
    mark = "@property\n" if any("property" in one for one in decorators) else ""
    wrapped = textwrap.fill(text, 96, subsequent_indent="    ", break_long_words=False)
    return f"```python\n{mark}{wrapped}\n```"


def _doc(node: ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) -> str:
    return as_markdown(ast.get_docstring(node) or "")


def _text_of(statement: ast.stmt | None) -> str:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        value = statement.value.value
        return " ".join(value.split()) if isinstance(value, str) else ""
    return ""


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
