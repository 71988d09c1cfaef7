"""Every how-to does what it says, from a clean copy of the project."""

import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "docs" / "start.md", *sorted((ROOT / "docs" / "howto").glob("*.md"))]


def load(name: str, file: str):
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(file))
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


howto = load("howto_pages", "howto.py")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_page_does_what_it_says(page, tmp_path):
    howto.copy_project(tmp_path)
    howto.run_page(page, tmp_path)


def test_python_examples_run(tmp_path):
    """Those of pages that are no how-to; a short run stands in for the log that they read."""
    howto.copy_project(tmp_path)
    short = tmp_path / "short.md"
    short.write_text(
        "```bash\nteleop-sim run src-dish --seed 1 --time-limit 40s --quiet --json > run.json || test $? = 1\n```\n",
        encoding="utf-8",
    )
    howto.run_page(short, tmp_path)
    for name in ("README.md", "docs/log.md"):
        howto.run_page(ROOT / name, tmp_path, only="python")


def test_blocks_have_language_title_and_line():
    page = 'text\n\n```toml title="a.toml"\nx = 1\n```\n```bash\nls\n```\n'
    assert howto.blocks(page) == [
        howto.Block("toml", "a.toml", "x = 1\n", 4),
        howto.Block("bash", "", "ls\n", 7),
    ]


def page_of(tmp_path: Path, text: str) -> Path:
    (tmp_path / ".bin").mkdir(exist_ok=True)
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    return page


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("```bash\ntrue\nfalse\ntrue\n```\n", 2),
        ("```bash\n# exits with 2\ntrue\n```\n", 2),
        ("```bash\necho 1\n```\n\n```text\n2\n```\n", 6),
        ("```python\nraise SystemExit(1)\n```\n", 2),
        ("```diff\n--- a/x\n+++ b/x\n@@ -1 +1 @@\n-1\n+2\n```\n", 2),
        ("```text\n2\n```\n", 2),
    ],
)
def test_a_block_that_does_not_do_what_it_says_is_named(tmp_path, text, line):
    with pytest.raises(howto.Broken, match=f"^page.md:{line}: "):
        howto.run_page(page_of(tmp_path, text), tmp_path)


def test_files_diffs_and_wildcards(tmp_path):
    text = (
        '```csv title="a/x.csv"\none\ntwo\n```\n'
        "```diff\n--- a/a/x.csv\n+++ b/a/x.csv\n@@ -1,2 +1,2 @@\n one\n-two\n+three\n```\n"
        "```bash\n# exits with 3\ncat a/x.csv\nexit 3\n```\n```text\none\n...ree\n```\n"
        '```python\nprint(open("a/x.csv").read())\n```\n```text\none\nthree\n```\n'
    )
    howto.run_page(page_of(tmp_path, text), tmp_path)


def test_a_copy_runs_its_own_code(tmp_path):
    howto.copy_project(tmp_path)
    asks = "import teleop_sim.channel\nprint(teleop_sim.channel.__file__)"
    text = f"```python\n{asks}\n```\n```text\n{tmp_path}/teleop_sim/channel/__init__.py\n```\n"
    howto.run_page(page_of(tmp_path, text), tmp_path)
