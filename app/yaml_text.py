"""YAML that people write by hand: configurations and robot profiles."""

import json
import re
from collections.abc import Sequence
from typing import Any

import yaml


class RefusedYamlError(yaml.YAMLError):
    """The text is YAML, and not of a kind that is read; it says what would work."""


class _Loader(yaml.SafeLoader):
    """Reads 1e-3 as a number, as YAML 1.2 and JSON do, and refuses duplicate names and aliases.

    With aliases, a file of a few hundred bytes holds a value of billions of entries.
    """

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise RefusedYamlError("aliases (*name) are not read: write the value itself")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        names: set[str] = set()
        for key, _ in node.value:
            # A key that is a list or a mapping is refused by the loader.
            if isinstance(key, yaml.ScalarNode):
                if key.value in names:
                    raise RefusedYamlError(f"{key.value!r} is defined twice in one group")
                names.add(key.value)
        return super().construct_mapping(node, deep=deep)


def _group(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    names: set[str] = set()
    for name, _ in pairs:
        if name in names:
            raise RefusedYamlError(f"{name!r} is defined twice in one group")
        names.add(name)
    return dict(pairs)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+$"),
    list("-+0123456789."),
)


def parse_yaml(text: str) -> Any:
    """Return the value of a YAML or JSON text.

    Raises:
        yaml.YAMLError: It is neither, has duplicate names or aliases, or is nested too deeply.
    """
    if text.lstrip().startswith("{"):
        # YAML takes no tabs as indentation. A YAML text may begin so, too.
        try:
            return json.loads(text, object_pairs_hook=_group)
        except ValueError:
            pass
        except RecursionError as error:
            raise RefusedYamlError("it is nested too deeply") from error
    try:
        return yaml.load(text, Loader=_Loader)  # noqa: S506 - a subclass of SafeLoader
    except RecursionError as error:
        raise RefusedYamlError("it is nested too deeply") from error
