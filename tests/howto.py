"""Runs the fenced blocks of a Markdown page as a reader would, in a copy of the project.

By its language a block is

- ``toml``, ``csv``, ``python`` and others with ``title="my.toml"``: written to that file of the copy;
- ``diff``: applied with ``patch -p1``;
- ``bash``: run line by line, as with ``set -e``; a first line ``# exits with 1`` says that the last line ends so;
- ``python`` without a title: run, all of a page's in one interpreter, as the cells of a notebook;
- ``text`` after ``bash`` or ``python``: what was printed, where ``...`` stands for anything, as in doctest;
- anything else, such as ``console``: only to be read.
"""

from __future__ import annotations

import doctest
import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONGEST_S = 300
_FENCE = re.compile(r"^```(?P<language>[\w-]+)?(?P<options>[^`]*)$")
_TITLE = re.compile(r'title="([^"]+)"')
_EXITS = re.compile(r"^# exits with (\d+)$")
SHIM = """#!/bin/sh
exec {python} -m teleop_sim "$@"
"""


NOTEBOOK = """
import contextlib, io, json, sys, traceback
names = {"__name__": "__main__"}
for line in sys.stdin:
    printed, code = io.StringIO(), 0
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        try:
            exec(compile(json.loads(line), "<page>", "exec"), names)
        except BaseException:
            traceback.print_exc()
            code = 1
    print(json.dumps([code, printed.getvalue()]), flush=True)
"""


class Broken(Exception):
    """A block of a page does not do what it says."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the file it is to be, its text, the line of the page on which that begins."""

    language: str
    title: str
    text: str
    line: int


def blocks(markdown: str) -> list[Block]:
    """The fenced blocks of a page, in order."""
    found: list[Block] = []
    lines = iter(enumerate(markdown.splitlines(), start=1))
    for number, line in lines:
        fence = _FENCE.match(line)
        if fence is None:
            continue
        text: list[str] = []
        for _, inner in lines:
            if inner == "```":
                break
            text.append(inner)
        else:
            raise Broken(f"line {number}: the block has no end")
        title = _TITLE.search(fence["options"])
        found.append(Block(fence["language"] or "", title[1] if title else "", "\n".join(text) + "\n", number + 1))
    return found


def copy_project(into: Path) -> None:
    """The project's files as they are in the working tree, symlinks kept; and what stands in for an installation.

    Those that git does not ignore: in a clone that is the commit, else also what somebody is about to add.
    """
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    files = subprocess.run(listing, cwd=ROOT, capture_output=True, check=True, text=True).stdout
    for name in filter(None, files.split("\0")):
        source, target = ROOT / name, into / name
        if source.is_symlink() or source.exists():  # a file that was just removed is still listed
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target, follow_symlinks=False)
    # What numba has compiled lies beside its sources, and holds for a copy of the same age and size.
    for compiled in ROOT.glob("teleop_sim/*/__pycache__/*.nb?"):
        target = into / compiled.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(compiled, target)
    shim = into / ".bin" / "teleop-sim"
    shim.parent.mkdir()
    shim.write_text(SHIM.format(python=sys.executable), encoding="utf-8")
    shim.chmod(0o755)


def environment(copy: Path) -> dict[str, str]:
    """In which ``teleop-sim`` and ``import teleop_sim`` are the copy's."""
    path = os.pathsep.join([str(copy / ".bin"), str(Path(sys.executable).parent), os.environ["PATH"]])
    return {**os.environ, "PATH": path, "PYTHONPATH": str(copy), "COLUMNS": "100", "MPLBACKEND": "agg"}


def run_page(page: Path, copy: Path, only: str = "") -> None:
    """Do what a page says, in a copy of the project; ``only`` blocks of this language.

    Raises:
        Broken: with page and line.

    """
    with Reader(copy) as reader:
        for block in blocks(page.read_text(encoding="utf-8")):
            if only and block.language != only:
                continue
            try:
                reader.do(block)
            except Broken as error:
                raise Broken(f"{page.name}:{block.line}: {error}") from None


class Reader:
    """Somebody who follows a page. ``printed``: what a ``text`` block is compared with; None: nothing was run yet."""

    def __init__(self, copy: Path) -> None:
        self._copy, self._env = copy, environment(copy)
        self._notebook: subprocess.Popen[str] | None = None
        self.printed: str | None = None

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *_: object) -> None:
        if self._notebook is not None:
            self._notebook.communicate()

    def do(self, block: Block) -> None:
        """Do what one block says.

        Raises:
            Broken: it does not do what it says.

        """
        if block.title:
            file = self._copy / block.title
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.text, encoding="utf-8")
        elif block.language == "diff":
            self._run(["patch", "-p1", "--no-backup-if-mismatch"], block.text)
        elif block.language == "bash":
            exits = _EXITS.match(block.text.partition("\n")[0])
            self._run(["bash", "-e", "-o", "pipefail", "-c", block.text], "", int(exits[1]) if exits else 0)
        elif block.language == "python":
            self._cell(block.text)
        elif block.language == "text":
            if self.printed is None:
                raise Broken("there is nothing before it that prints")
            compare(block.text, self.printed)

    def _run(self, command: list[str], given: str, exits: int = 0) -> None:
        done = subprocess.run(
            command,
            cwd=self._copy,
            env=self._env,
            input=given,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=LONGEST_S,
            check=False,
        )
        if done.returncode != exits:
            raise Broken(f"exit code {done.returncode}, not {exits}:\n{done.stdout}")
        self.printed = done.stdout

    def _cell(self, code: str) -> None:
        if self._notebook is None:
            self._notebook = subprocess.Popen(
                [sys.executable, "-c", NOTEBOOK],
                cwd=self._copy,
                env=self._env,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        assert self._notebook.stdin is not None
        assert self._notebook.stdout is not None
        self._notebook.stdin.write(json.dumps(code) + "\n")
        self._notebook.stdin.flush()
        answer = self._notebook.stdout.readline()
        if not answer:
            raise Broken("the interpreter ended")
        failed, self.printed = json.loads(answer)
        if failed:
            raise Broken(self.printed)


def compare(expected: str, printed: str) -> None:
    """Compare what a page says is printed with what was.

    Raises:
        Broken: they differ.

    """
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    if not doctest.OutputChecker().check_output(expected, printed, flags):
        raise Broken(f"expected\n{expected}\nbut printed was\n{printed}")
