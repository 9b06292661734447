import sys

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
