"""The documentation as a site: built strictly, every link in it leads somewhere, and it is spelt right."""

from __future__ import annotations

import json
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

import pytest

SPELT = (
    "README.md",
    "CHANGELOG.md",
    "docs",
    "daq",
    "ident",
    "drivers",
    "trajectories",
    "robots",
    "benchmarks",
)


class Links(HTMLParser):
    """What a page links to and shows, and the anchors that it has."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if name in ("href", "src") and value and not value.startswith(("http:", "https:", "data:")):
                self.targets.append(value)
            if name == "id" and value:
                self.anchors.add(value)


@pytest.fixture(scope="module")
def site(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    words = [sys.executable, "-W", "ignore", "-m", "mkdocs", "build", "--strict", "--quiet"]
    done = subprocess.run(
        [*words, "--site-dir", str(folder)], cwd=repository, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_every_page_is_on_it_and_can_be_searched(site: Path, repository: Path) -> None:
    pages = [page.relative_to(repository / "docs") for page in (repository / "docs").rglob("*.md")]
    pages += [page.relative_to(repository) for page in (repository / "benchmarks").glob("*.md")]
    assert all((site / page.with_suffix("") / "index.html").is_file() for page in pages)
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    searched = {entry["location"].partition("#")[0] for entry in index["docs"]}
    assert searched >= {f"{page.with_suffix('').as_posix()}/" for page in pages}


@pytest.mark.slow
def test_every_link_of_the_site_leads_somewhere(site: Path) -> None:
    read = {page: Links(page.read_text(encoding="utf-8")) for page in site.rglob("*.html")}
    broken = []
    for page, links in read.items():
        if page.name == "404.html":
            continue  # shown at any address, so its links begin at the root of the site
        for target in links.targets:
            path, anchor = urldefrag(unquote(target))
            file = (page.parent / path).resolve() if path else page
            file = file / "index.html" if file.is_dir() else file
            if not file.exists() or (anchor and file in read and anchor not in read[file].anchors):
                broken.append(f"{page.relative_to(site)}: {target}")
    assert len(read) > 40
    assert not broken, "\n".join(broken)


def test_pages_and_code_are_spelt_right(repository: Path) -> None:
    words = [sys.executable, "-m", "codespell_lib", *SPELT]
    done = subprocess.run(words, cwd=repository, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
