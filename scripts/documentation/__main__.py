"""Builds the site of the documents: `python -m scripts.documentation [--pages-only] [OUT]`."""

import argparse
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from scripts.documentation.pages import Pages
from scripts.documentation.reference import ADDED, write_reference

ROOT = Path(__file__).parents[2]
CONFIG = Path(__file__).with_name("zensical.toml")
STYLES = Path(__file__).with_name("tables.css")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the pages, and build the site from them; broken links fail.

    Args:
        arguments: Of the command line; those of the process without any.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", nargs="?", type=Path, default=ROOT / "build" / "docs")
    parser.add_argument("--pages-only", action="store_true", help="write the pages as Markdown")
    options = parser.parse_args(arguments)
    out = options.out.resolve()
    try:
        _make_way(out)
    except OSError as error:
        print(f"docs: {error}", file=sys.stderr)
        return 1
    pages = Pages(ROOT, out / "pages", ADDED)
    shutil.copy(STYLES, out / "pages" / STYLES.name)
    for page, text in write_reference(ROOT).items():
        pages.write(page, text)
    try:
        pages.copy_documents()
    except FileNotFoundError as error:
        print(f"docs: {error}, which does not exist", file=sys.stderr)
        return 1
    if options.pages_only:
        return 0
    done = subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--clean", "--strict"], cwd=out, check=False
    )
    if done.returncode == 0:
        print(f"{out / 'site' / 'index.html'}")
        print(f"python3 -m http.server --directory {out / 'site'}    # serves it, with search")
    return done.returncode


def _make_way(out: Path) -> None:
    """Remove what an earlier run wrote, and nothing else; leave the file that says so.

    Raises:
        OSError: The folder holds the checkout or what no run wrote, or cannot be written.
    """
    if out == ROOT or out in ROOT.parents:
        raise FileExistsError(f"{out} holds the checkout; name another folder")
    if out.is_dir() and any(out.iterdir()) and not (out / CONFIG.name).exists():
        raise FileExistsError(f"{out} holds files that are not of the site; name another folder")
    for name in ("pages", "site"):
        shutil.rmtree(out / name, ignore_errors=True)
    (out / "pages").mkdir(parents=True)
    shutil.copy(CONFIG, out / CONFIG.name)


if __name__ == "__main__":
    raise SystemExit(main())
