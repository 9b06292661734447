"""The site of the documents: reference from the code, links to pages, a strict build."""

import importlib.util
import re
import shutil
import subprocess
import sys

import msgspec
import pytest

from app.cli.main import run
from app.messages import keys, status
from scripts.documentation.__main__ import main
from scripts.documentation.command_options import option_rows
from scripts.documentation.pages import Pages, with_whole_words
from scripts.documentation.python_source import as_markdown
from scripts.documentation.reference import (
    ADDED,
    PUBLIC,
    command_line,
    commands,
    configuration_fields,
    message_types,
    python_interface,
)
from tests.locations import ROOT


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The pages of the site, without the reference."""
    out = tmp_path_factory.mktemp("site")
    Pages(ROOT, out, ADDED).copy_documents()
    return out


def test_code_of_several_words_in_a_table_breaks_between_them_alone(tmp_path):
    row = "| `ippon eval` <code>--rate A&#124;B</code> | `no_travel_pitch`, not `a <b` |"
    spans = (
        "| <code><span>ippon</span> <span>eval</span></code> "
        "<code><span>--rate</span> <span>A&#124;B</span></code> | `no_travel_pitch`, not "
        "<code><span>a</span> <span>&lt;b</span></code> |"
    )
    assert with_whole_words(row) == spans
    fenced = f"```\n{row}\n```"
    Pages(ROOT, tmp_path, ADDED).write("a.md", f"`two words`\n{row}\n{fenced}\n")
    assert (tmp_path / "a.md").read_text("utf-8") == f"`two words`\n{spans}\n{fenced}\n"


def test_every_command_is_in_the_reference():
    text = command_line()
    words = [words for words, _ in commands()]
    assert {"demo", "foxglove", "eval run", "eval habitat", "doctor"} <= set(words)
    assert re.findall(r"^## ippon (.+)$", text, re.MULTILINE) == words


@pytest.mark.parametrize("words", [words for words, _ in commands()])
def test_the_options_of_the_reference_are_those_of_help(words, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    with pytest.raises(SystemExit):
        run([*words.split(), "--help"])
    printed = set(re.findall(r"(?<![\w-])--[a-z][\w.-]*", _options_of(capsys.readouterr().out)))
    rows = option_rows(dict(commands())[words])
    listed = {name for option, *_ in rows for name in re.findall(r"--[a-z][\w.-]*", option)}
    assert listed == printed - {"--help"}
    assert all(meaning for *_, meaning in option_rows(dict(commands())[words]))


def _options_of(text):
    """The left column of a help text."""
    lines = [line.strip("│ ") for line in text.splitlines() if re.match(r"[│ ]{0,4}--?\w", line)]
    return "\n".join(re.split(r"\s{2,}", line)[0] for line in lines)


def test_every_field_of_the_configuration_is_in_the_reference():
    text = configuration_fields()
    assert "voxel_size_m: 0.1" in text
    assert "# [m] Edge of a voxel" in text


def test_every_key_and_every_field_of_a_message_is_in_the_reference():
    text = message_types(ROOT)
    for key, kind in keys.ROS_TYPES.items():
        assert f"| <code>{key}</code> | <code>{kind}</code> |" in text
    for frame in (keys.WORLD_FRAME, keys.BASE_FRAME, keys.CAMERA_FRAME):
        assert f"| <code>{frame}</code> |" not in text
    assert text.count("| <code>odom</code> |") == 1
    assert "| <code>ended</code> | plain text |" in text
    assert "| <code>alive/navigator</code> | liveliness token |" in text
    section = text.split("\n## Status\n")[1].split("\n## ")[0]
    for field in msgspec.structs.fields(status.Status):
        assert f"| <code>{field.name}</code> | " in section
    assert "Robot time of the latest frame." in section
    assert "float32[] gains" in text


def test_the_python_interface_has_signatures_and_meanings():
    text = python_interface(ROOT)
    assert re.findall(r"^## (.+)$", text, re.MULTILINE) == list(PUBLIC)
    section = text.split("## app.recognition.frames")[1].split("\n## ")[0]
    assert "open_source(path: Path, floor_m: float | None=None" in section
    assert "- `track`: Find the poses of a dataset by its images" in section
    assert "_dataset_frames" not in text


def test_sections_of_a_docstring_are_lists():
    text = as_markdown(
        "Do it.\n\nArgs:\n    a: First,\n        and more.\n\nReturns:\n    Nothing."
    )
    assert text.replace("\n\n\n", "\n\n") == (
        "Do it.\n\n**Args**\n\n- `a`: First,\n  and more.\n\n**Returns**\n\n- Nothing."
    )


def test_files_of_the_repository_that_are_linked_have_pages(site):
    text = (site / "guides" / "researcher.md").read_text("utf-8")
    assert "(../source/examples/your_planner.py.md)" in text
    code = (site / "source" / "examples" / "your_planner.py.md").read_text("utf-8")
    assert "class AheadFirst(NearestFrontier):" in code
    listed = (site / "source" / "examples" / "index.md").read_text("utf-8")
    assert "- [why_there.py](why_there.py.md)" in listed
    assert (site / "source" / "CONTRIBUTING.md").exists()
    assert (site / "images" / "search.webp").exists()


def test_a_link_that_leads_nowhere_is_named(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.md").write_text("```\n[a](none.md)\n```\n[b](missing.md)\n")
    with pytest.raises(FileNotFoundError, match=r"docs/index.md links missing.md"):
        Pages(tmp_path, tmp_path / "out", {}).copy_documents()


def test_what_the_site_adds_is_added_to_documents(site):
    for page, text in ADDED.items():
        assert (site / page).read_text("utf-8").endswith(f"{text}\n")


def test_a_folder_of_other_files_is_left_as_it_is(tmp_path, capsys):
    kept = tmp_path / "keep.txt"
    kept.write_text("mine")
    assert main(["--pages-only", str(tmp_path)]) == 1
    assert "not of the site" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == [kept]


@pytest.mark.parametrize("above", [0, 1])
def test_a_folder_that_holds_the_checkout_is_no_place_for_the_site(
    above, tmp_path, capsys, monkeypatch
):
    root = tmp_path / "checkout"
    root.mkdir()
    (root / "zensical.toml").touch()
    (tmp_path / "zensical.toml").touch()
    monkeypatch.setattr("scripts.documentation.__main__.ROOT", root)
    assert main(["--pages-only", str([root, tmp_path][above])]) == 1
    assert "holds the checkout" in capsys.readouterr().err
    assert root.is_dir()


def test_pages_replace_those_of_an_earlier_run_and_nothing_else(tmp_path):
    out = tmp_path / "docs"
    assert main(["--pages-only", str(out)]) == 0
    kept = out / "keep.txt"
    kept.write_text("mine")
    (out / "pages" / "old.md").write_text("of a document that is gone")
    assert main(["--pages-only", str(out)]) == 0
    assert kept.read_text() == "mine"
    assert not (out / "pages" / "old.md").exists()
    assert (out / "pages" / "index.md").exists()


def test_a_relative_folder_is_one_of_where_it_was_typed(tmp_path):
    root, here = tmp_path / "checkout", tmp_path / "here"
    (root / "scripts").mkdir(parents=True)
    (root / ".venv" / "bin").mkdir(parents=True)
    here.mkdir()
    shutil.copy(ROOT / "scripts" / "docs", root / "scripts")
    for name, text in (("scripts/setup", ""), (".venv/bin/python", 'echo "$@"')):
        (root / name).write_text(f"#!/bin/sh\n{text}\n")
        (root / name).chmod(0o755)
    done = subprocess.run(
        [root / "scripts" / "docs", "--pages-only", "out"],
        cwd=here, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == (f"-m scripts.documentation --pages-only {here / 'out'}")


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("zensical") is None,
    reason="zensical builds the site: scripts/docs installs it",
)
def test_the_site_is_built_without_a_broken_link_or_anchor(tmp_path):
    command = [sys.executable, "-m", "scripts.documentation", str(tmp_path / "docs")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    built = tmp_path / "docs" / "site"
    assert "foxglove" in (built / "search.json").read_text("utf-8")
    users = ("operator", "requester", "reviewer", "integrator", "researcher")
    assert all((built / "users" / f"{name}.html").exists() for name in users)
    assert "https://fonts" not in (built / "index.html").read_text("utf-8")
