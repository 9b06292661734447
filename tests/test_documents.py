"""The documents: links, paths and commands that they name exist; the README stays short."""

import re
import shlex
from pathlib import Path

import pytest

from app.cli.main import parse
from ippon.evaluation.methods.method_table import METHODS
from tests.benchmarks.__main__ import BENCHMARKS
from tests.locations import ROOT
from tests.mutation.parts import PARTS

DOCUMENTS = sorted(
    [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*.md")]
)
LINK = re.compile(r"\]\(([^)#\s]*)(?:#([^)\s]+))?\)")
OURS = re.compile(
    r"`((?:ippon|app|tests|scripts|docs|examples|web_assets)/[\w./-]*)`"
    r"|(?<!\.\./)\b((?:ippon|app|tests|scripts|docs|examples|web_assets)/[\w/-]+"
    r"\.(?:py|md|js|json5|svg|png))\b"
)
FENCE = re.compile(r"```.*?```", re.DOTALL)
README_WORDS = 700
NOT_PATHS = {"ippon/robot-1"}
LARGEST_PICTURE = 3_000_000


def anchors(text: str) -> set[str]:
    """The anchors of a document's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_links_lead_somewhere(document):
    for target, anchor in LINK.findall(document.read_text("utf-8")):
        if re.match(r"\w+:", target):
            continue
        path = (document.parent / target).resolve() if target else document
        assert path.exists(), f"{name(document)} links {target}"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path.read_text("utf-8")), f"{name(document)}: #{anchor}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_paths_that_are_named_exist(document):
    for quoted, bare in OURS.findall(document.read_text("utf-8")):
        path = quoted or bare
        if path in NOT_PATHS:
            continue
        assert (ROOT / path).exists(), f"{name(document)} names {path}"


def test_paths_that_the_code_names_exist():
    for folder in ("ippon", "app", "tests", "scripts", "web_assets"):
        for source in (ROOT / folder).rglob("*"):
            if source.suffix not in (".py", ".js", ".html", "") or not source.is_file():
                continue
            for path in re.findall(r"\bdocs/[\w/-]+\.\w+", source.read_text("utf-8")):
                assert (ROOT / path).exists(), f"{name(source)} names {path}"


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text("utf-8").split()) <= README_WORDS


def test_decisions_are_few_and_short():
    entries = re.findall(
        r"^\*\*.+(?:\n.+)*", (ROOT / "docs" / "decisions.md").read_text("utf-8"), re.MULTILINE
    )
    assert 0 < len(entries) <= 40
    assert max(entry.count("\n") + 1 for entry in entries) <= 5
    assert max(map(len, entries)) <= 600


def test_every_part_of_the_results_names_its_command():
    """Or says that it was measured once."""
    text = (ROOT / "docs" / "results.md").read_text("utf-8")
    parts = re.split(r"^#{2,3} ", text, flags=re.MULTILINE)[1:]
    assert len(parts) > 10
    without = [
        part.partition("\n")[0]
        for part in parts
        if re.search(r"\b\d", part.partition("\n")[2])
        and not re.search(r"scripts/|ippon |evaluate |coverage run|\*Once\*|\*once\*", part)
    ]
    assert without == []


def test_pictures_are_small():
    for picture in (ROOT / "docs").rglob("*"):
        if picture.suffix in (".png", ".webp", ".svg"):
            assert picture.stat().st_size <= LARGEST_PICTURE, name(picture)


def test_the_methods_of_the_guide_are_those_of_the_evaluation():
    text = (ROOT / "docs" / "guides" / "researcher.md").read_text("utf-8")
    section = text.split("## Methods")[1].split("\n## ")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)) == set(METHODS)


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_benchmarks_and_mutated_parts_that_are_named_exist(document):
    text = document.read_text("utf-8")
    named = re.findall(r"scripts/benchmark ([a-z][a-z|-]*)", text)
    assert {one for names in named for one in names.split("|")} <= {*BENCHMARKS, "all"}
    assert set(re.findall(r"scripts/mutation ([a-z_]+)", text)) <= set(PARTS)


def test_contributing_names_every_benchmark_and_every_mutated_part():
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    for command, names in (("benchmark", {*BENCHMARKS, "all"}), ("mutation", set(PARTS))):
        first, others = re.findall(rf"`scripts/{command} ([\w-]+)` \(or ([^)]+)\)", text)[0]
        assert {first, *re.findall(r"`([\w-]+)`", others)} == names


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_commands_that_are_shown_are_understood(document, capsys):
    """Every `ippon` line of a block for the shell, up to the first operator of the shell."""
    wrong = []
    for block in re.findall(r"```(?:sh|bash)\n(.*?)```", document.read_text("utf-8"), re.DOTALL):
        for line in block.replace("\\\n", " ").splitlines():
            if not line.startswith("ippon ") or "$" in line:
                continue
            command = re.split(r" (?:&&|[|>;]) ?", line)[0]
            try:
                parse(shlex.split(command, comments=True)[1:])
            except SystemExit as ended:
                wrong += [(line, capsys.readouterr().err)] if ended.code else []
    assert wrong == []


SPEAKING = [
    *(one for one in DOCUMENTS if one.name != "CHANGELOG.md"),
    *sorted((ROOT / "docs" / "examples").rglob("*.py")),
    *sorted((ROOT / "app" / "cli" / "options").glob("*.py")),
]


@pytest.mark.parametrize("document", SPEAKING, ids=name)
def test_options_and_commands_within_sentences_exist(document, capsys):
    """`ippon …` in backquotes may lack arguments, and names no unknown command or option."""
    wrong = []
    for command in re.findall(r"`(ippon [a-z][^`{}…|\[]*)`", FENCE.sub("", document.read_text())):
        if "..." in command:
            continue
        try:
            parse(shlex.split(command.split(" > ")[0])[1:])
        except SystemExit as ended:
            said = capsys.readouterr().err
            unknown = re.search("unrecognized|invalid choice", said, re.IGNORECASE)
            wrong += [(command, said)] if ended.code and unknown else []
    assert wrong == []


@pytest.mark.parametrize("document", SPEAKING, ids=name)
def test_evaluations_within_sentences_say_where_their_rows_go(document):
    text = FENCE.sub("", document.read_text("utf-8"))
    options = re.findall(r"`ippon eval run (--[^`]*)`", text)
    assert [one for one in options if "--out" not in one] == []


def test_the_reference_names_the_environment_variables_that_the_code_reads():
    read = {
        name
        for path in (ROOT / "app").rglob("*.py")
        for name in re.findall(r'"((?:IPPON|OPENAI|NUMBA)_[A-Z_]+)"', path.read_text("utf-8"))
    }
    table = (ROOT / "docs/reference/configuration.md").read_text("utf-8")
    assert {name for name in read if f"`{name}`" not in table} == set()
