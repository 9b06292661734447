"""`ippon user`: users of the console's login."""

import getpass
import sys

from app.cli.options.tools import User
from app.errors import UsageError
from app.nodes.console.web.accounts import AccountError, add_account


def run_user(command: User) -> int:
    """Ask for the password and write the file."""
    try:
        replaced = add_account(command.users, command.name, _password(), command.role)
    except AccountError as error:
        raise UsageError(str(error)) from error
    done = "changed" if replaced else "added"
    print(f"{command.name} ({command.role}) {done} in {command.users}")
    return 0


def _password() -> str:
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    try:
        password = getpass.getpass("Password: ")
        again = getpass.getpass("Again: ")
    except EOFError:
        print(file=sys.stderr)
        raise UsageError("no password; nothing was changed") from None
    if again != password:
        raise UsageError("the two passwords differ; nothing was changed")
    return password
