"""What the site has besides docs/: README as its first page, and the pages of benchmarks/.

Links are written for the clone, where the pages stand in their folders. On the site README and the benchmarks
have moved; files that are no pages are named and not linked.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parent.parent
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


def on_config(config: Any) -> Any:
    """Headings get the anchors that the clone's links use, which are those of GitHub."""
    config.mdx_configs.setdefault("toc", {})["slugify"] = anchor_of
    return config


def anchor_of(title: str, separator: str) -> str:
    """``# export-model --json`` → ``export-model---json``."""
    return re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", separator)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages from outside docs/."""
    outside = {"index.md": ROOT / "README.md", "changelog.md": ROOT / "CHANGELOG.md"}
    outside |= {f"benchmarks/{page.name}": page for page in sorted((ROOT / "benchmarks").glob("*.md"))}
    for name, source in outside.items():
        files.append(File.generated(config, name, content=source.read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Links of the clone as links of the site."""
    place = page.file.src_uri
    in_clone = {"index.md": "README.md", "changelog.md": "CHANGELOG.md"}.get(place, place)
    folder = posixpath.dirname(
        in_clone if place != in_clone or place.startswith("benchmarks/") else f"docs/{place}"
    )

    def moved(match: re.Match[str]) -> str:
        mark, text, target = match.groups()
        if re.match(r"[a-z]+:|#", target):
            return match.group(0)
        path, hash_mark, heading = target.partition("#")
        found = site_path(posixpath.normpath(posixpath.join(folder, path)), files)
        if found is None:
            return text
        link = posixpath.relpath(found, posixpath.dirname(place) or ".")
        return f"{mark}[{text}]({link}{hash_mark}{heading})"

    return _LINK.sub(moved, markdown)


def site_path(in_clone: str, files: Files) -> str | None:
    """Where a file of the clone is on the site; None where it is not."""
    moved = {"README.md": "index.md", "CHANGELOG.md": "changelog.md"}.get(in_clone, in_clone)
    name = moved.removeprefix("docs/")
    return name if files.get_file_from_path(name) is not None else None
