"""`ippon doctor --licences`: installed packages, their licences, and what each is for."""

import json
from dataclasses import asdict

from rich.console import Console
from rich.table import Table
from rich.text import Text

from app.doctor.packages import NOT_STATED, NotInstalledError, Package, installed_packages
from app.errors import UsageError


def run_licences(*, as_json: bool) -> int:
    """Print the packages, as a table or as JSON."""
    try:
        packages = installed_packages()
    except NotInstalledError as error:
        raise UsageError(str(error)) from error
    if as_json:
        print(json.dumps([asdict(one) for one in packages]))
    else:
        _print_table(packages)
    return 0


def _print_table(packages: list[Package]) -> None:
    table = Table(title="Packages and their licences", title_justify="left", title_style="bold")
    for column in ("package", "version"):
        table.add_column(column)
    table.add_column("MB", justify="right")
    table.add_column("licence")
    table.add_column("for")
    for one in packages:
        licence = Text(one.licence, style="yellow" if one.licence == NOT_STATED else "")
        size = f"{one.megabytes:.0f}" if one.megabytes >= 1.0 else ""
        table.add_row(one.name, one.version, size, licence, _reason(one))
    screen = Console()
    screen.print(table)
    total = sum(one.megabytes for one in packages)
    screen.print(
        f"{len(packages)} packages, {total:.0f} MB. Licences are those that the packages state of "
        "themselves; where one states none, look in its source. --json names the files that hold "
        "their texts. Some wheels contain further libraries."
    )


def _reason(one: Package) -> Text:
    if not one.purpose:
        return Text(f"needed by {', '.join(one.needed_by)}", style="dim")
    text = Text(one.purpose)
    if one.extras:
        text.append(f" (extra: {', '.join(one.extras)})", style="dim")
    if one.versions:
        text.append(f"\nversions: {one.versions}", style="dim")
    return text
