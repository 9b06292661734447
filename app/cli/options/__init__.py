"""Options of the commands: dataclasses whose docstrings are the text of `--help`."""
