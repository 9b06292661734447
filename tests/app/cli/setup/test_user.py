"""`ippon user` at a terminal."""

import getpass
import sys

import pytest

from app.cli.main import run


@pytest.mark.parametrize("typed", [[], ["correct horse"]])
def test_a_password_that_is_not_typed_changes_nothing(typed, tmp_path, capsys, monkeypatch):
    left = iter(typed)

    def answer(_):
        try:
            return next(left)
        except StopIteration:
            raise EOFError from None

    monkeypatch.setattr(getpass, "getpass", answer)
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
    users = tmp_path / "users"
    assert run(["user", "anna", "--users", str(users)]) == 2
    assert capsys.readouterr().err == "\nippon: no password; nothing was changed\n"
    assert not users.exists()
