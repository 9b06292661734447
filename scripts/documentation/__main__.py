"""Builds the site of the documents: `python -m scripts.documentation [--pages-only] [OUT]`."""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from scripts.documentation.pages import Pages
from scripts.documentation.reference import ADDED, write_reference

ROOT = Path(__file__).parents[2]
CONFIG = Path(__file__).with_name("zensical.toml")
STYLES = Path(__file__).with_name("tables.css")


def main() -> int:
    """Write the pages, and build the site from them; broken links fail."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", nargs="?", type=Path, default=ROOT / "build" / "docs")
    parser.add_argument("--pages-only", action="store_true", help="write the pages as Markdown")
    options = parser.parse_args()
    out = options.out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    pages = Pages(ROOT, out / "pages", ADDED)
    (out / "pages").mkdir(parents=True)
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
    shutil.copy(CONFIG, out / CONFIG.name)
    done = subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--clean", "--strict"], cwd=out, check=False
    )
    if done.returncode == 0:
        print(f"{out / 'site' / 'index.html'}")
        print(f"python3 -m http.server --directory {out / 'site'}    # serves it, with search")
    return done.returncode


if __name__ == "__main__":
    raise SystemExit(main())
