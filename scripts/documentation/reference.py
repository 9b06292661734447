"""Pages that are written from the code: command line, configuration, messages, Python."""

import ast
import contextlib
import io
import os
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, get_args

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from app.cli.main import run
from app.cli.options.commands import Command
from app.doctor.packages import purposes
from app.messages import keys
from scripts.documentation.command_options import describe_command
from scripts.documentation.python_source import (
    as_code,
    classes_of,
    describe_module,
    documented_values,
    field_table,
    fields_of,
    read_module,
    table,
)

WIDTH: Final = 100
PUBLIC: Final = (
    "ippon.frame", "ippon.camera", "ippon.observation", "ippon.mapping.config",
    "ippon.mapping.voxel_map", "ippon.mapping.mesh", "ippon.segmentation.config",
    "ippon.segmentation.loading", "ippon.segmentation.segmenter", "ippon.planning.interface",
    "ippon.planning.plan", "ippon.mission.mission", "ippon.simulation.scene",
    "ippon.simulation.world", "ippon.evaluation.trial", "ippon.evaluation.methods.method_table",
    "ippon.evaluation.statistics", "app.recognition.frames", "app.recognition.recognition",
    "app.links.language_model.interface", "app.export.session_data",
)  # fmt: skip
"""Modules for programs of others: those of the examples, and of the guide to extending."""
_PYTHON: Final = (
    "Modules that programs of others may use: those of the examples and of the guide to "
    "[extending](../guides/extending.md). They may change with a minor version before 1.0, "
    "which the changelog says; everything else may change at any time."
)
_PACKAGES: Final = (
    "What each package is for. Where nothing else is said, the lower bounds of the base install "
    "were tested together, with tests of `app/` that start no process, and an upper bound is the "
    "next version that may change an interface. "
    "`ippon doctor --licences` lists those that are installed, with what they need themselves, "
    "their licences and sizes."
)
JSON_MODULES: Final = ("control", "status", "driving", "lease", "memory", "recording", "body")


ADDED: Final = {
    "reference/configuration.md": "[Every field, its default and its meaning]"
    "(configuration-fields.md).",
    "reference/messages.md": "[The types of the messages, field by field](message-types.md).",
    "guides/extending.md": "[Reference of the Python interface](../reference/python.md).",
    "users/requester.md": "[Reference of the command line](../reference/command-line.md).",
    "users/researcher.md": "[Reference of the Python interface](../reference/python.md).",
    "users/integrator.md": "Reference: [command line](../reference/command-line.md), "
    "[fields of the configuration](../reference/configuration-fields.md), "
    "[types of the messages](../reference/message-types.md), [packages](../reference/packages.md).",
}
"""What the site adds to documents: links to pages that are not in the repository."""


def write_reference(root: Path) -> dict[str, str]:
    """Return the pages of the reference by their place in the site."""
    return {
        "reference/command-line.md": command_line(),
        "reference/configuration-fields.md": configuration_fields(),
        "reference/message-types.md": message_types(root),
        "reference/packages.md": packages(root),
        "reference/python.md": python_interface(root),
    }


def command_line() -> str:
    """Return every command with its options, as `--help` explains them."""
    parts = [
        "# Command line",
        "What `ippon COMMAND --help` says; words in capitals stand for values.",
    ]
    for words, kind in commands():
        parts += [f"## ippon {words}", describe_command(kind)]
    return "\n\n".join(parts) + "\n"


def commands() -> Iterator[tuple[str, Any]]:
    """Yield words and dataclass of every command."""
    for name, kind in _names(Command):
        inner = kind.__dataclass_fields__.get("command")
        if inner is None:
            yield name, kind
        else:
            yield from ((f"{name} {word}", one) for word, one in _names(inner.type))


def configuration_fields() -> str:
    """Return what `ippon config` prints."""
    text = _printed(["config"])
    return (
        "# Fields of the configuration\n\nWhat `ippon config` prints: every field with its "
        "default, unit and meaning. [How to change them](configuration.md).\n\n"
        f"```yaml\n{text.rstrip()}\n```\n"
    )


def message_types(root: Path) -> str:
    """Return keys, JSON messages and ROS definitions."""
    messages = root / "app" / "messages"
    parts = ["# Types of the messages", "[What they are for](messages.md).", "## Keys"]
    parts.append(_key_table(messages / "keys.py"))
    for module in JSON_MODULES:
        for node in classes_of(read_module(messages / f"{module}.py")):
            if not any(ast.unparse(b) in ("Struct", "_Message", "_Published") for b in node.bases):
                continue
            parts += [f"## {node.name}", f"`app/messages/{module}.py`"]
            parts += [ast.get_docstring(node) or "", field_table(fields_of(node)).rstrip()]
    for path in sorted((messages / "msg").rglob("*.msg")):
        name = f"{path.parent.name}/msg/{path.stem}"
        parts += [f"## {name}", f"```text\n{path.read_text('utf-8').rstrip()}\n```"]
    return "\n\n".join(part for part in parts if part) + "\n"


def packages(root: Path) -> str:
    """Return what each package is for that `pyproject.toml` names."""
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    parts = ["# Packages", _PACKAGES, _package_table(project["dependencies"])]
    for extra, named in sorted(project["optional-dependencies"].items()):
        parts += [f"## Extra: {extra}", _package_table(named)]
    return "\n\n".join(parts) + "\n"


def _package_table(named: Sequence[str]) -> str:
    rows: list[tuple[str, str, str]] = []
    for requirement in map(Requirement, named):
        said = purposes()[canonicalize_name(requirement.name)]
        reason = said["for"]
        if "versions" in said:
            reason += f" ({said['versions']})"
        if requirement.marker is not None:
            reason += f"; only where {as_code(str(requirement.marker))}"
        # The lower bound first.
        bounds = sorted(map(str, requirement.specifier), reverse=True)
        rows.append((requirement.name, as_code(", ".join(bounds)), reason))
    return table(("package", "versions", "for"), rows).rstrip()


def python_interface(root: Path) -> str:
    """Return the public modules with their classes and functions."""
    parts = ["# Python", _PYTHON]
    for module in PUBLIC:
        path = root / (module.replace(".", "/") + ".py")
        parts.append(describe_module(path, module))
    return "\n\n".join(parts) + "\n"


def _key_table(path: Path) -> str:
    rows: list[tuple[str, str, str]] = []
    for statement, text in documented_values(read_module(path).body):
        value = statement.value
        if not (isinstance(value, ast.Constant) and isinstance(value.value, str)):
            continue
        if ast.unparse(statement).partition(" = ")[0].endswith("_FRAME"):
            continue  # A coordinate frame, of which nothing is published.
        kind = keys.ROS_TYPES.get(value.value, "")
        other = keys.NOT_JSON.get(value.value, "JSON")
        rows.append((as_code(value.value), as_code(kind) if kind else other, text))
    return table(("key", "type", "meaning"), rows)


def _names(union: Any) -> Iterator[tuple[str, Any]]:
    """Yield name and type of each subcommand of a union."""
    for option in get_args(union):
        kind, mark = get_args(option) if hasattr(option, "__metadata__") else (option, None)
        if mark is not None and getattr(mark, "name", None):
            yield mark.name, kind


def _printed(arguments: list[str]) -> str:
    """Return what a command prints, as on a terminal of `WIDTH` columns without colours."""
    os.environ.update(COLUMNS=str(WIDTH), NO_COLOR="1", TERM="dumb")
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
        run(arguments)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines())
