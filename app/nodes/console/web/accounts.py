"""Users with role and password: a file with one line per user, readable by its owner only."""

import base64
import binascii
import hashlib
import hmac
import re
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.nodes.console.web.browsers import ROLES, Role
from ippon.atomic_file import replace_file

MIN_PASSWORD: Final = 8
MAX_PASSWORD: Final = 1024
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,38}")
_N, _R, _P = 2**15, 8, 1
"""Cost of scrypt: 32 MiB and about 60 ms per guess."""
_MEMORY: Final = 64 * 2**20
_COLUMNS: Final = 4


class AccountError(Exception):
    """A file of users, or a user, is invalid; the text says what would work."""


@dataclass(frozen=True, slots=True)
class _Account:
    role: Role
    salt: bytes
    digest: bytes


class Accounts:
    """Users who may log in."""

    def __init__(self, accounts: dict[str, _Account]) -> None:
        self._accounts = accounts
        self._nobody = _Account("viewer", secrets.token_bytes(16), secrets.token_bytes(32))

    def __len__(self) -> int:
        return len(self._accounts)

    def verify(self, name: str, password: str) -> Role | None:
        """Return the role of a user with the right password, None otherwise.

        It takes equally long for an unknown name, so that the time reveals nothing.
        """
        account = self._accounts.get(name, self._nobody)
        given = _digest(password[:MAX_PASSWORD], account.salt)
        known = hmac.compare_digest(given, account.digest)
        return account.role if known and name in self._accounts else None


def load_accounts(path: Path) -> Accounts:
    """Read a file of users.

    Raises:
        AccountError: It cannot be read, others may read it, it is empty, or a line is invalid.
    """
    try:
        mode = path.stat().st_mode
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise AccountError(
            f"the users in {path} cannot be read ({error}); make the file with: ippon user NAME "
            f"--users {path}"
        ) from error
    if mode & 0o077:
        raise AccountError(
            f"other users of this machine may read {path}; restrict it with: chmod 600 {path}"
        )
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    accounts = dict(_read(line, path) for line in lines)
    if not accounts:
        raise AccountError(f"{path} holds no user; add one with: ippon user NAME --users {path}")
    return Accounts(accounts)


def one_account(name: str, password: str, role: Role) -> Accounts:
    """Return accounts with a single user, for a password from the environment.

    Raises:
        AccountError: The password is too short.
    """
    _check(name, password)
    salt = secrets.token_bytes(16)
    return Accounts({name: _Account(role, salt, _digest(password, salt))})


def add_account(path: Path, name: str, password: str, role: Role) -> bool:
    """Add a user to the file, or replace the one of that name.

    Returns:
        Whether there was one of that name.

    Raises:
        AccountError: The name or password is invalid, or the file cannot be read or written.
    """
    _check(name, password)
    salt = secrets.token_bytes(16)
    line = ":".join([name, role, _text(salt), _text(_digest(password, salt))])
    try:
        before = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        others = [old for old in before if old.split(":", 1)[0] != name]
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, "".join(f"{one}\n" for one in [*others, line]).encode(), mode=0o600)
    except (OSError, UnicodeDecodeError) as error:
        raise AccountError(f"the users in {path} cannot be changed ({error})") from error
    return len(others) < len(before)


def _check(name: str, password: str) -> None:
    if _NAME.fullmatch(name) is None:
        raise AccountError(
            f"a user's name is 1 to 39 letters, digits, spaces and . _ -, for example anna; got "
            f"{name[:60]!r}"
        )
    if not MIN_PASSWORD <= len(password) <= MAX_PASSWORD:
        raise AccountError(
            f"a password has {MIN_PASSWORD} to {MAX_PASSWORD} characters; this one has "
            f"{len(password)}"
        )


def _read(line: str, path: Path) -> tuple[str, _Account]:
    columns = line.split(":")
    if len(columns) == _COLUMNS and columns[1] in ROLES:
        name, role, salt, digest = columns
        try:
            account = _Account(role, _bytes(salt), _bytes(digest))  # pyright: ignore[reportArgumentType]
        except binascii.Error:
            pass
        else:
            return name, account
    raise AccountError(
        f"{path} has an invalid line ({line[:20]!r}…); each is NAME:ROLE:SALT:HASH, made "
        "with: ippon user NAME"
    )


def _digest(password: str, salt: bytes) -> bytes:
    secret = password.encode(errors="surrogatepass")
    return hashlib.scrypt(secret, salt=salt, n=_N, r=_R, p=_P, maxmem=_MEMORY, dklen=32)


def _text(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).decode()


def _bytes(text: str) -> bytes:
    return base64.b64decode(text, altchars=b"-_", validate=True)
