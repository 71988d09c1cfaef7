"""The documentation site: it builds, it loads nothing from elsewhere, and its references leave nothing out."""

import html
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
import typer.main
from playwright.sync_api import sync_playwright

import teleop_sim
from teleop_sim.cli_commands import app
from teleop_sim.core import records
from teleop_sim.reports.registry import RUN_PARTS, SWEEP_PARTS

ROOT = Path(__file__).parents[1]
LOADING = {
    ("audio", "src"), ("embed", "src"), ("iframe", "src"), ("img", "src"), ("img", "srcset"), ("input", "src"),
    ("link", "href"), ("object", "data"), ("script", "src"), ("source", "src"), ("source", "srcset"), ("track", "src"),
    ("use", "href"), ("image", "href"), ("video", "poster"), ("video", "src"),
}  # fmt: skip
"""Attributes whose address a browser fetches by itself; those of ``a`` it only follows."""
OWN = ("file:", "data:", "blob:")
ELSEWHERE = re.compile(r"^\s*(?:https?:)?//", re.IGNORECASE)


class Loads(HTMLParser):
    """What a page would load, and what its style elements say."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.classes: set[str] = set()

    def handle_starttag(self, tag, attributes):
        self.addresses += [value or "" for key, value in attributes if (tag, key) in LOADING]
        self.classes |= {name for key, value in attributes if key == "class" for name in (value or "").split()}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


def shown(page: Path) -> str:
    return html.unescape(re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8")))


def test_no_page_loads_anything_from_another_host(site):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        loads = Loads()
        loads.feed(page.read_text(encoding="utf-8"))
        assert [a for a in loads.addresses if ELSEWHERE.match(a)] == [], page.name
        # The theme's script would fetch the program that draws these.
        assert "mermaid" not in loads.classes, page.name


def test_no_style_loads_anything_from_another_host(site):
    for sheet in [*site.rglob("*.css"), *site.rglob("*.svg"), *site.rglob("*.html")]:
        text = sheet.read_text(encoding="utf-8")
        found = re.findall(r"""(?:url\(|@import)\s*["']?\s*((?:https?:)?//[^"')\s]+)""", text)
        assert found == [], sheet.name


@pytest.fixture(scope="module")
def browser():
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    assert found, "no chromium on the path: install the system's (Debian: apt-get install chromium)"
    with sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=found, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def page(browser):
    """A page 400 pixels wide in a browser without a network; what it complains of and asks for is an error."""
    context = browser.new_context(viewport={"width": 400, "height": 800}, offline=True)
    page, wrong = context.new_page(), []
    page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request", lambda asked: None if asked.url.startswith(("file:", "data:", "blob:")) else wrong.append(asked.url)
    )
    yield page
    context.close()
    assert wrong == []


def test_every_page_opens_from_disk_and_fits_a_telephone(site, page):
    for file in sorted(site.rglob("*.html")):
        if file.name != "404.html":
            page.goto(file.as_uri())
            assert page.evaluate("document.documentElement.scrollWidth") <= 400, file.name


def test_the_search_works_from_disk(site, page):
    page.goto((site / "link.html").as_uri())
    page.click("label[for=__search]")
    page.locator("input.md-search__input").press_sequentially("blackout")
    page.wait_for_selector(".md-search-result__item")


def test_tables_and_lists_are_rendered_as_such(site):
    """A table that runs into the one above it, or a list without a line before it, is shown as its source."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.search(r"<td[^>]*>:?-{3,}", text), page.name
        for paragraph in re.findall(r"<p>(.*?)</p>", text, re.DOTALL):
            assert not re.search(r"^(?:- |\d+\. |\|)", paragraph, re.MULTILINE), f"{page.name}: {paragraph[:80]}"


def test_every_part_of_a_report_is_told(site):
    text = " ".join(shown(site / "reports.html").split())
    for part in (*RUN_PARTS, *SWEEP_PARTS):
        assert part.title.removesuffix(", in figures") in text, f"say in docs/reports.md what {part.title!r} shows"


def test_every_command_has_a_section(site):
    text = shown(site / "reference" / "cli.html")

    def commands(group, above):
        for name, command in group.commands.items():
            yield f"{above} {name}", command
            if hasattr(command, "commands"):
                yield from commands(command, f"{above} {name}")

    for name, command in commands(typer.main.get_command(app), "teleop-sim"):
        assert name in text, name
        for parameter in command.params:
            assert parameter.opts[-1] in text or parameter.metavar in text, f"{name} {parameter.opts}"


def test_every_public_name_is_told(site):
    headings = (site / "reference" / "api.html").read_text(encoding="utf-8")
    for name in teleop_sim.__all__:
        if not name.startswith("_"):
            value = getattr(teleop_sim, name)
            assert f'id="{value.__module__}.{name}"' in headings, name


def test_every_record_is_told(site):
    headings = (site / "reference" / "records.html").read_text(encoding="utf-8")
    for kind in records.RECORDS.values():
        assert f'id="{kind.__module__}.{kind.__name__}"' in headings, kind


def test_the_picture_of_the_concepts_is_the_one_that_its_script_makes():
    import importlib.util

    spec = importlib.util.spec_from_file_location("concepts_picture", ROOT / "docs" / "figures" / "concepts.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    for name, ink in module.FILES.items():
        assert (ROOT / "docs" / "pictures" / name).read_text(encoding="utf-8") == module.picture(ink), name
