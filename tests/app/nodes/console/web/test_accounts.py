"""The file of users."""

import pytest

from app.nodes.console.web.accounts import AccountError, add_account, load_accounts, one_account

PASSWORD = "correct horse"


@pytest.fixture
def users(tmp_path):
    path = tmp_path / "deep" / "users"
    assert add_account(path, "anna", PASSWORD, "operator") is False
    return path


@pytest.mark.slow
def test_a_user_who_knows_the_password_has_a_role(users):
    add_account(users, "bert", "battery staple", "viewer")
    accounts = load_accounts(users)
    assert len(accounts) == 2
    assert accounts.verify("anna", PASSWORD) == "operator"
    assert accounts.verify("bert", "battery staple") == "viewer"
    for name, password in [
        ("anna", "correct hors"), ("anna", ""), ("bert", PASSWORD), ("Anna", PASSWORD),
        ("", PASSWORD), ("nobody", PASSWORD), ("anna", "\ud800"), ("anna", "x" * 10**6),
    ]:  # fmt: skip
        assert accounts.verify(name, password) is None


def test_the_file_is_for_its_owner_only_and_holds_no_password(users):
    assert users.stat().st_mode & 0o777 == 0o600
    assert PASSWORD not in users.read_text()
    assert list(users.parent.iterdir()) == [users]


def test_equal_passwords_look_different(users):
    add_account(users, "bert", PASSWORD, "operator")
    one, two = (line.split(":") for line in users.read_text().splitlines())
    assert one[3] != two[3]


@pytest.mark.slow
def test_a_user_can_be_changed(users):
    assert add_account(users, "anna", "another one", "supervisor") is True
    accounts = load_accounts(users)
    assert accounts.verify("anna", PASSWORD) is None
    assert accounts.verify("anna", "another one") == "supervisor"


@pytest.mark.parametrize(
    ("name", "password", "text"),
    [
        ("", PASSWORD, "a user's name is 1 to 39 letters"),
        ("a:b", PASSWORD, "a user's name"),
        ("a\nb", PASSWORD, "a user's name"),
        ("anna", "short", "8 to 1024 characters; this one has 5"),
    ],
)
def test_what_is_no_user_is_refused(tmp_path, name, password, text):
    with pytest.raises(AccountError, match=text):
        add_account(tmp_path / "users", name, password, "viewer")
    with pytest.raises(AccountError, match=text):
        one_account(name, password, "viewer")
    assert not (tmp_path / "users").exists()


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("", "holds no user; add one with: ippon user NAME"),
        ("# nobody\n\n", "holds no user"),
        ("anna:operator:AA", "an invalid line"),
        ("anna:god:AA==:AA==", "an invalid line"),
        ("anna:viewer:!!!!:AA==", "an invalid line"),
    ],
)
def test_a_file_that_will_not_do_is_refused(tmp_path, content, text):
    path = tmp_path / "users"
    path.touch(mode=0o600)
    path.write_text(content)
    with pytest.raises(AccountError, match=text):
        load_accounts(path)


def test_a_file_that_others_may_read_is_refused(users):
    users.chmod(0o640)
    with pytest.raises(AccountError, match="chmod 600"):
        load_accounts(users)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(AccountError, match=r"cannot be read .* make the file with: ippon user"):
        load_accounts(tmp_path / "none")
