import subprocess
import sys

import pytest

from app.evaluation import version
from app.evaluation.version import code_of, version_text
from ippon import extensions


def test_the_code_of_an_installed_method_is_named_and_changes_with_its_files(tmp_path, monkeypatch):
    package = tmp_path / "my_planner"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "rule.py").write_text("WORTH = 1\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setattr(
        extensions,
        "module_of",
        lambda _, name: "my_planner.rule" if name in {"mine", "ippon"} else None,
    )
    before = code_of("mine")
    assert before.startswith("mine code ")
    assert version_text(["ippon", "mine"]).endswith(f", {before}")
    assert code_of("mine@power=2") == before
    assert version_text(["mine", "mine@power=2"]).count(before) == 1
    assert "ippon code" not in version_text(["ippon", "mine"])
    (package / "rule.py").write_text("WORTH = 2\n")
    assert code_of("mine") != before
    assert version.code_of("ippon") is None


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A checkout of one file, with one commit."""
    monkeypatch.setattr(version, "_ROOT", tmp_path)
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "rule.py").write_text("WORTH = 1\n")
    author = ("-c", "user.name=a", "-c", "user.email=a@b")
    for words in (("init", "-q"), ("add", "."), (*author, "commit", "-q", "-m", "first")):
        subprocess.run(["git", "-C", str(tmp_path), *words], check=True)
    return tmp_path


def test_different_changes_since_a_commit_are_different_versions(checkout):
    def write(name, text):
        (checkout / name).write_text(text)
        return version._commit()

    clean = version._commit()
    assert "+" not in clean
    first = write("app/rule.py", "WORTH = 2\n")
    assert first.startswith(f"{clean}+changes.")
    second = write("app/rule.py", "WORTH = 3\n")
    third = write("app/other.py", "")
    fourth = write("app/other.py", "WORTH = 4\n")
    assert len({clean, first, second, third, fourth}) == 5
    assert write("notes.txt", "") == fourth
    (checkout / "app/other.py").unlink()
    assert write("app/rule.py", "WORTH = 1\n") == clean


def test_what_is_no_checkout_is_installed(tmp_path, monkeypatch):
    monkeypatch.setattr(version, "_ROOT", tmp_path)
    assert version._commit() == "installed"
