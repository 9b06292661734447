"""`--config FILE`: values from a configuration file, which flags override."""

from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeVar

from app.cli.options.evaluation import EvalRun
from app.cli.options.nodes import Demo, Navigate
from app.configuration import ConfigurationError, changed, read_file
from app.errors import UsageError
from app.nodes.navigator.config import NavigatorConfig

Options = TypeVar("Options", bound=Navigate | Demo | EvalRun)

_VOXEL_SIZE: Final = {"voxel_size_m": "mission.map.voxel_size_m"}
FLAGS: Final[dict[type, dict[str, str]]] = {
    Navigate: {
        "listen": "listen",
        "robot": "robot",
        "seed": "seed",
        "map": "keep_map",
        "resume": "resume",
        "map_memory_mb": "mission.map.memory_limit_mb",
        "step_budget_s": "mission.planner.step_budget_s",
        "llm.look_every_s": "look_every_s",
        "llm.second_opinion": "second_opinion",
        **_VOXEL_SIZE,
    },
    Demo: {
        "seed": "seed",
        "llm.look_every_s": "look_every_s",
        "llm.second_opinion": "second_opinion",
        **_VOXEL_SIZE,
    },
    EvalRun: dict(_VOXEL_SIZE),
}
"""Fields of the configuration that a command also takes as flags."""
SET_ELSEWHERE: Final = {
    "profile": "--profile",
    "detector": "--profile",
    "camera_clock_offset_s": "--profile",
    "observation_model": "--observation-model",
    "language_model": "--llm.model",
}
"""Fields of the navigator's configuration that only flags set, with these flags."""
DERIVED: Final = {
    "mission.map.min_range_m": "--profile",
    "mission.map.max_range_m": "--profile",
    "mission.map.max_valid_depth_m": "--profile",
    "mission.planner.step_budget_s": "--step-budget-s",
    "heatmap_lost_s": "--segmentation.where",
    "keep_searches": "--robot",
}
"""Fields whose value without a file follows from flags, with these flags."""


def read_config(path: Path | None) -> dict[str, Any]:
    """Return the checked tree of a configuration file; empty without a file.

    Raises:
        UsageError: The file cannot be used; the text names the field.
    """
    if path is None:
        return {}
    try:
        tree = read_file(path)
        check_tree(tree)
    except ConfigurationError as error:
        raise UsageError(str(error)) from error
    return tree


def check_tree(tree: Mapping[str, Any]) -> NavigatorConfig:
    """Return the navigator's configuration with changed fields.

    Raises:
        ConfigurationError: A field is unknown, is set elsewhere, or has a wrong value.
    """
    for name, flag in SET_ELSEWHERE.items():
        if name in tree:
            raise ConfigurationError(f"{name}: set it with {flag}, not in a file")
    return changed(NavigatorConfig(), tree)


def with_file(options: Options) -> Options:
    """Return the options with the file's values as the values of their flags.

    Raises:
        UsageError: The file cannot be used.
    """
    tree = read_config(options.config)
    config = check_tree(tree)
    for flag, name in FLAGS[type(options)].items():
        if _has(tree, name):
            options = _with_value(options, flag, _flag_value(flag, _value(config, name)))
    return options


def beyond_flags(kind: type, tree: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a tree that have no flag."""
    return _without(tree, set(FLAGS[kind].values()))


def _flag_value(flag: str, value: Any) -> Any:
    if flag == "map":
        return Path(value) if value else None
    if flag == "step_budget_s":
        return value or 0.0
    return value


def _has(tree: Mapping[str, Any], name: str) -> bool:
    node: Any = tree
    for part in name.split("."):
        if not isinstance(node, Mapping) or part not in node:
            return False
        node = node[part]
    return True


def _value(config: object, name: str) -> Any:
    node: Any = config
    for part in name.split("."):
        node = getattr(node, part)
    return node


def _with_value(options: Any, flag: str, value: Any) -> Any:
    first, _, rest = flag.partition(".")
    inner = getattr(options, first)
    if rest and is_dataclass(inner):
        value = _with_value(inner, rest, value)
    return replace(options, **{first: value})


def _without(tree: Mapping[str, Any], names: set[str], above: str = "") -> dict[str, Any]:
    kept: dict[str, Any] = {}
    for name, value in tree.items():
        if f"{above}{name}" in names:
            continue
        left = _without(value, names, f"{above}{name}.") if isinstance(value, Mapping) else value
        if left != {}:
            kept[name] = left
    return kept
