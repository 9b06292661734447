"""The options of a command as a table, from its dataclass."""

import ast
import dataclasses
import inspect
import textwrap
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from tyro.conf import Positional

from scripts.documentation.python_source import as_code, as_markdown, fields_of, table

POSITIONAL = get_args(Positional[int])[1]


def describe_command(kind: Any) -> str:
    """Return what a command does, and its options, as Markdown."""
    rows = list(option_rows(kind))
    text = as_markdown(inspect.cleandoc(kind.__doc__ or ""))
    return f"{text}\n\n{table(('option', 'default', 'meaning'), rows)}" if rows else text


def option_rows(kind: Any, prefix: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield name with values, default and meaning of each option, groups of options included."""
    meanings = _meanings(kind)
    hints = get_type_hints(kind, include_extras=True)
    for field in dataclasses.fields(kind):
        hint, marks = hints[field.name], ()
        if get_origin(hint) is Annotated:
            hint, *marks = get_args(hint)
        if dataclasses.is_dataclass(hint):
            yield from option_rows(hint, f"{prefix}{field.name}.")
            continue
        name = f"{prefix}{field.name}".replace("_", "-")
        if POSITIONAL in marks:
            shown = field.name.replace("_", "-").upper()
        elif hint is bool:
            shown = f"--{name}, --{prefix}no-{field.name.replace('_', '-')}"
        else:
            shown = f"--{name} {_values(hint)}".rstrip()
        yield as_code(shown), _default(field), meanings.get(field.name, "")


def _meanings(kind: Any) -> dict[str, str]:
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        if dataclasses.is_dataclass(one):
            (node,) = ast.parse(textwrap.dedent(inspect.getsource(one))).body
            assert isinstance(node, ast.ClassDef)
            found |= {name: text for name, _, _, text in fields_of(node)}
    return found


def _values(hint: Any) -> str:
    """Return what a value looks like: its type in capitals, or its choices."""
    origin = get_origin(hint)
    if origin is Literal:
        return "|".join(str(one) for one in get_args(hint))
    if origin in (Union, types.UnionType):
        return "|".join(_values(one) for one in get_args(hint) if one is not type(None))
    if origin is tuple:
        return f"{_values(get_args(hint)[0])} ..."
    return {Path: "PATH"}.get(hint, getattr(hint, "__name__", str(hint)).upper())


def _default(field: Any) -> str:
    value = field.default
    if value is dataclasses.MISSING and field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    if value is dataclasses.MISSING:
        return "required"
    if value in (None, "", ()):
        return ""
    if isinstance(value, bool):
        return "on" if value else "off"
    return as_code(" ".join(map(str, value)) if isinstance(value, tuple) else str(value))
