"""What the site has beside the pages in this folder: the references, the changelog, figures for light and dark."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import api_page
import cli_page
from mkdocs.structure.files import File, Files

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page

DARK = ".dark.svg"
FIGURES = "_generated"
"""Where pages find the figures that are made with the site."""
_PICTURE = re.compile(r"!\[(?P<alt>[^\]]*)\]\((?P<stem>[^)#\s]+)\.svg\)")
_FOREIGN = re.compile(r'<script src="https://unpkg\.com/iframe-worker/shim"></script>')


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made of the code and of files outside this folder."""
    root = Path(config.config_file_path).parent
    made = {
        "reference/cli.md": cli_page.markdown(),
        "reference/api.md": api_page.names_markdown(),
        "reference/records.md": api_page.records_markdown(),
        "changelog.md": (root / "CHANGELOG.md").read_text(encoding="utf-8"),
    }
    for uri, text in made.items():
        files.append(File.generated(config, uri, content=text))
    for name, svg in _figures(root).items():
        files.append(File.generated(config, f"{FIGURES}/{name}", content=svg))
    return files


def _figures(root: Path) -> dict[str, str]:
    sys.path.insert(0, str(root / "docs" / "figures"))
    import make

    return make.figures()


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put the dark twin of a figure beside it, where there is one; the theme shows the one that fits."""
    del config

    def both(found: re.Match[str]) -> str:
        alt, stem = found["alt"], found["stem"]
        folder = page.file.src_uri.rpartition("/")[0]
        if files.get_file_from_path(_joined(folder, f"{stem}{DARK}")) is None:
            return found[0]
        return f"![{alt}]({stem}.svg#only-light)![{alt}]({stem}{DARK}#only-dark)"

    return _PICTURE.sub(both, markdown)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Let the search of pages opened from disk use a script of ours: the theme would load one from another host."""
    del config
    up = "../" * page.url.count("/")
    return _FOREIGN.sub(f'<script src="{up}scripts/frame_worker.js"></script>', output)


def on_post_template(output_content: str, template_name: str, config: MkDocsConfig) -> str:
    """The page for addresses that are not there is shown by servers alone: it needs no such script."""
    del template_name, config
    return _FOREIGN.sub("", output_content)


def _joined(folder: str, link: str) -> str:
    """A link of a page in ``folder`` as a path from the top of the site."""
    parts = [part for part in folder.split("/") if part]
    for part in link.split("/"):
        if part == "..":
            parts.pop()
        elif part != ".":
            parts.append(part)
    return "/".join(parts)
