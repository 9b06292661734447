"""Configuration dataclasses from files and from NAME=VALUE: checked, changed and described."""

import ast
import difflib
import functools
import inspect
import math
import textwrap
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

import msgspec
import yaml

from app.yaml_text import parse_yaml

Config = TypeVar("Config")
Names = tuple[str, ...]
MAX_FILE_BYTES: Final = 1_000_000
LINE_WIDTH: Final = 100
UNITS: Final = {
    "m_s2": "m/s²",
    "rad_s2": "rad/s²",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "per_m": "1/m",
    "per_s": "1/s",
    "m2": "m²",
    "m3": "m³",
    "ms": "ms",
    "ns": "ns",
    "mb": "MB",
    "gb": "GB",
    "hz": "Hz",
    "px": "pixels",
    "deg": "degrees",
    "rad": "rad",
    "m": "m",
    "s": "s",
}
"""Units by suffix of the field's name, the longest first."""


class ConfigurationError(ValueError):
    """A configuration cannot be used; the text names the field and valid values."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A field whose value is not its default."""

    name: str
    """Dotted path of the field."""
    value: Any
    default: Any


def read_file(path: Path) -> dict[str, Any]:
    """Return the tree of a YAML or JSON file.

    Raises:
        ConfigurationError: The file cannot be read, or is not a mapping of names to values.
    """
    if path.is_file() and path.stat().st_size > MAX_FILE_BYTES:
        raise ConfigurationError(f"{path} is too large for a configuration")
    try:
        tree = parse_yaml(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigurationError(f"configuration {path}: {error}") from error
    if tree is None:
        return {}
    if not isinstance(tree, dict):
        raise ConfigurationError(
            f"configuration {path} is not a mapping of names to values; `ippon config` prints a "
            f"template"
        )
    return typing.cast("dict[str, Any]", tree)


def changed(config: Config, changes: Mapping[str, Any], path: Names = ()) -> Config:
    """Return a configuration with some of its fields changed.

    Args:
        config: A dataclass; nested dataclasses are groups of fields.
        changes: Values by field name; for a group, a mapping of the same kind.
        path: Names of the enclosing groups, for error texts.

    Raises:
        ConfigurationError: A name is unknown, or a value has the wrong type or is invalid.
    """
    known: dict[str, Any] = {f.name: getattr(config, f.name) for f in fields(config)}  # pyright: ignore[reportArgumentType]
    hints = _hints(type(config))
    values: dict[str, Any] = {}
    for name, value in changes.items():
        if name not in known:
            raise _unknown(config, str(name), path)
        if is_dataclass(known[name]):
            if not isinstance(value, Mapping):
                raise ConfigurationError(
                    f"{_dotted((*path, name))} is a group of fields; got {value!r}"
                )
            values[name] = changed(known[name], typing.cast("Any", value), (*path, name))
        else:
            values[name] = _converted(value, hints[name], (*path, name))
    try:
        return replace(typing.cast("Any", config), **values)
    except ValueError as error:
        where = _dotted((*path, *values)) if len(values) == 1 else _dotted(path)
        raise ConfigurationError(f"{where or 'configuration'}: {error}") from error


def assign(tree: dict[str, Any], name: str, value: Any) -> None:
    """Set the value of a dotted name in a tree, creating its groups."""
    *groups, last = name.split(".")
    for group in groups:
        tree = tree.setdefault(group, {})
        if not isinstance(tree, dict):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ConfigurationError(f"{name}: {group} already has a value")
    tree[last] = value


def parse_changes(config: object, changes: Sequence[str], group: str = "") -> dict[str, Any]:
    """Return the tree of changes given as NAME=VALUE.

    Args:
        config: The configuration to change.
        changes: Dotted names and YAML values.
        group: Group whose fields may be given without its name.

    Raises:
        ConfigurationError: A change is not NAME=VALUE.
    """
    tree: dict[str, Any] = {}
    for change in changes:
        name, equals, text = change.partition("=")
        if not equals or not name:
            raise ConfigurationError(
                f"a change is NAME=VALUE, like map.voxel_size_m=0.05; got {change!r}"
            )
        first = name.split(".")[0]
        if group and not hasattr(config, first) and hasattr(getattr(config, group), first):
            name = f"{group}.{name}"
        try:
            assign(tree, name, parse_yaml(text))
        except yaml.YAMLError as error:
            raise ConfigurationError(f"{name}: {text!r} is not a YAML value: {error}") from error
    return tree


def differences(config: object, default: object, path: Names = ()) -> Iterator[Difference]:
    """Yield every field in which two configurations of one type differ."""
    for name, value in _values(config):
        before = getattr(default, name)
        if is_dataclass(value) and type(value) is type(before):
            yield from differences(value, before, (*path, name))
        elif value != before:
            yield Difference(name=_dotted((*path, name)), value=value, default=before)


def field_names(config: object, path: Names = ()) -> Iterator[str]:
    """Yield the dotted name of every field that is not a group."""
    for name, value in _values(config):
        if is_dataclass(value):
            yield from field_names(value, (*path, name))
        else:
            yield _dotted((*path, name))


def as_yaml(
    config: object,
    left_out: Sequence[str] = (),
    derived: Mapping[str, str] = MappingProxyType({}),
    path: Names = (),
) -> str:
    """Return a configuration as YAML; a comment above each field gives its unit and explanation.

    Args:
        config: A dataclass.
        left_out: Names of fields to omit.
        derived: Dotted names of fields that something else determines, with what it is; they are
            commented out.
        path: Names of the enclosing groups.
    """
    indent = "  " * len(path)
    explained = explanations(type(config))
    parts: list[str] = []
    for name, value in _values(config):
        if name in left_out:
            continue
        if is_dataclass(value):
            text = explained.get(name) or inspect.cleandoc(type(value).__doc__ or "")
            parts.append(f"\n{_comment(text, indent)}{indent}{name}:\n")
            parts.append(as_yaml(value, derived=derived, path=(*path, name)))
        else:
            unit = unit_of(name)
            text = f"[{unit}] {explained.get(name, '')}" if unit else explained.get(name, "")
            written = f"{name}: {_scalar(value)}"
            if origin := derived.get(_dotted((*path, name))):
                written = f"# {written}  # by default from {origin}"
            parts.append(f"{_comment(text.strip(), indent)}{indent}{written}\n")
    return "".join(parts)


def unit_of(name: str) -> str:
    """Return the unit in a field's name, empty without one."""
    return next((unit for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


@functools.cache
def explanations(kind: type) -> dict[str, str]:
    """Return the docstrings of the fields of a dataclass and of its bases."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if not is_dataclass(base):
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(base))).body[0]
        assert isinstance(body, ast.ClassDef)
        for statement, after in zip(body.body, body.body[1:], strict=False):
            match statement, after:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(text))),
                ):
                    found[name] = " ".join(text.split())
                case _:
                    pass
    return found


def _values(config: object) -> Iterator[tuple[str, Any]]:
    return ((f.name, getattr(config, f.name)) for f in fields(config))  # pyright: ignore[reportArgumentType]


@functools.cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _converted(value: Any, kind: Any, path: Names) -> Any:
    try:
        converted = msgspec.convert(value, kind)
    except (msgspec.ValidationError, ValueError) as error:
        if choices := typing.get_args(kind) if typing.get_origin(kind) is typing.Literal else ():
            listed = ", ".join(map(str, choices))
            raise ConfigurationError(
                f"{_dotted(path)} is one of {listed}; got {value!r}"
            ) from error
        raise ConfigurationError(f"{_dotted(path)}: {error}; got {value!r}") from error
    if isinstance(converted, float) and not math.isfinite(converted):
        raise ConfigurationError(f"{_dotted(path)} must be a finite number; got {value!r}")
    return converted


def _unknown(config: object, name: str, path: Names) -> ConfigurationError:
    """Return the error for an unknown name, with the most similar known name."""
    here = [field for field, _ in _values(config)]
    near = difflib.get_close_matches(name, here, n=1)
    below = [full for full in field_names(config) if full.split(".")[-1] == name]
    where = f"in {_dotted(path)}" if path else "in the configuration"
    if below:
        hint = f"did you mean {_dotted((*path, below[0]))}?"
    elif near:
        hint = f"did you mean {_dotted((*path, near[0]))}?"
    else:
        hint = f"there is {', '.join(here)}"
    return ConfigurationError(f"{_dotted((*path, name))}: no field {name!r} {where}; {hint}")


def _dotted(path: Names) -> str:
    return ".".join(path)


def _comment(text: str, indent: str) -> str:
    lines = textwrap.wrap(" ".join(text.split()), LINE_WIDTH - len(indent) - 2)
    return "".join(f"{indent}# {line}\n" for line in lines)


def _scalar(value: Any) -> str:
    """Return a value as YAML on one line; numbers as Python formats them."""
    plain = msgspec.to_builtins(value)
    text = yaml.safe_dump(plain, default_flow_style=True, width=10**6, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")
