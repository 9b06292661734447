"""Copies the documents, and turns links to files of the repository into links to pages.

What a document links outside docs/ gets a page of its own: Markdown as it is, a source file as a
block of code, a folder as a list.
"""

import html
import posixpath
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

LINK: Final = re.compile(r"(!?\[[^\]]*\]\()([^)#\s]+)((?:#[^)\s]*)?\))")
FENCE: Final = re.compile(r"(```.*?```)", re.DOTALL)
ROW: Final = re.compile(r"^\|.*$", re.MULTILINE)
"""A row of a table."""
CODE: Final = re.compile(r"`([^`]+)`|<code>([^<]+)</code>")
PICTURES: Final = frozenset({".png", ".svg", ".webp"})
SOURCE: Final = "source"
"""Folder of the pages of files outside docs/."""
_LANGUAGES: Final = {".py": "python", ".toml": "toml", ".yaml": "yaml", ".sh": "bash"}


class Pages:
    """The pages of a site, written into a folder."""

    def __init__(self, root: Path, out: Path, added: Mapping[str, str]) -> None:
        """Prepare a site.

        Args:
            root: The repository.
            out: Folder of the pages.
            added: Text to append to documents, by page.
        """
        self.root = root
        self._added = added
        self.out = out
        self._wanted: list[Path] = []
        """Files outside docs/ that a page links, in order."""
        self._placed: dict[Path, str] = {}
        """Page of each file of the repository, relative to the site."""

    def write(self, page: str, text: str) -> None:
        """Write a generated page."""
        path = self.out / page
        path.parent.mkdir(parents=True, exist_ok=True)
        parts = FENCE.split(text)
        parts[::2] = [ROW.sub(lambda m: with_whole_words(m.group()), part) for part in parts[::2]]
        path.write_text("".join(parts), "utf-8")

    def copy_documents(self) -> None:
        """Copy docs/, and make pages of everything that is linked from there.

        Raises:
            FileNotFoundError: A link leads nowhere; the text names page and link.
        """
        documents = self.root / "docs"
        for path in sorted(documents.rglob("*")):
            if path.suffix == ".md" or path.suffix in PICTURES:
                self._placed[path] = path.relative_to(documents).as_posix()
        for path, page in list(self._placed.items()):
            if path.suffix == ".md":
                text = self._with_links(path, page, path.read_text("utf-8"))
                more = self._added.get(page)
                self.write(page, text if more is None else f"{text}\n{more}\n")
            else:
                target = self.out / page
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(path.read_bytes())
        while self._wanted:
            self._write_source(self._wanted.pop(0))

    def _with_links(self, path: Path, page: str, text: str) -> str:
        """Return a document with its links changed, except in blocks of code."""
        parts = FENCE.split(text)
        parts[::2] = [LINK.sub(lambda m: self._link(path, page, m), part) for part in parts[::2]]
        return "".join(parts)

    def _link(self, path: Path, page: str, match: re.Match[str]) -> str:
        before, target, after = match.groups()
        if re.match(r"\w+:", target):
            return match.group()
        there = (path.parent / target).resolve()
        if not there.exists():
            raise FileNotFoundError(f"{path.relative_to(self.root)} links {target}")
        place = posixpath.relpath(self._place_of(there), posixpath.dirname(page) or ".")
        return f"{before}{place}{after}"

    def _place_of(self, there: Path) -> str:
        if there not in self._placed:
            name = there.relative_to(self.root).as_posix()
            if there.is_dir():
                name += "/index"
            is_plain = there.suffix in PICTURES
            is_page = there.suffix == ".md"
            self._placed[there] = f"{SOURCE}/{name}" + ("" if is_plain or is_page else ".md")
            self._wanted.append(there)
        return self._placed[there]

    def _write_source(self, path: Path) -> None:
        page, name = self._placed[path], path.relative_to(self.root).as_posix()
        if path.suffix in PICTURES:
            (self.out / page).parent.mkdir(parents=True, exist_ok=True)
            (self.out / page).write_bytes(path.read_bytes())
        elif path.suffix == ".md":
            self.write(page, self._with_links(path, page, path.read_text("utf-8")))
        elif path.is_dir():
            rows = [f"- [{one.name}]({self._relative(one, page)})" for one in _files(path)]
            self.write(page, f"# {name}/\n\n" + "\n".join(rows) + "\n")
        else:
            language = _LANGUAGES.get(path.suffix, "text")
            code = path.read_text("utf-8")
            self.write(page, f"# {name}\n\n````{language}\n{code}````\n")

    def _relative(self, path: Path, page: str) -> str:
        return posixpath.relpath(self._place_of(path), posixpath.dirname(page))


def with_whole_words(row: str) -> str:
    """Return a row of a table whose code breaks between words alone, by the site's style sheet."""
    return CODE.sub(_spans, row)


def _spans(match: re.Match[str]) -> str:
    code = match.group(2) or html.escape(match.group(1), quote=False)
    if " " not in code:
        return match.group()
    words = " ".join(f"<span>{word}</span>" for word in code.split(" "))
    return f"<code>{words}</code>"


def _files(folder: Path) -> Iterator[Path]:
    """Yield the files of a folder that are text."""
    for path in sorted(folder.rglob("*")):
        if path.suffix in _LANGUAGES or path.suffix == ".md":
            yield path
