"""`ippon config`: prints the configuration with explanations, or checks a file."""

from app.cli.config_file import DERIVED, SET_ELSEWHERE, check_tree, read_config
from app.cli.options.tools import Config
from app.configuration import as_yaml, differences
from app.nodes.navigator.config import NavigatorConfig


def run_config(command: Config) -> int:
    """Print every field as commented YAML, or the fields that a file changes."""
    if command.file is None:
        print("# The configuration of `ippon navigate --config FILE`. Keep the fields to change.")
        text = as_yaml(NavigatorConfig(), left_out=tuple(SET_ELSEWHERE), derived=DERIVED)
        print(text, end="")
        return 0
    config = check_tree(read_config(command.file))
    found = tuple(differences(config, NavigatorConfig()))
    for each in found:
        print(f"{each.name}: {each.value} (default {each.default})")
    if not found:
        print("no field differs from its default")
    return 0
