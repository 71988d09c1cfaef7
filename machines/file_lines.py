"""In which line of a machine's TOML file a problem is: found by the headers of its states, without a parser of its own.

States that are written as inline tables have no headers: then a problem has no line, or that of the container around.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

from teleop_sim.core.errors import Problem
from teleop_sim.machines.net import join

_HEADER = re.compile(r"\s*\[\[\s*states\s*((?:\.\s*states\s*)*)\]\]")
_NAME = re.compile(r"\s*name\s*=\s*([\"'].*)")
_EDGE = re.compile(r"\bstate\s*=")
_PLACE = re.compile(r"((?:states\[\d+\]\.?)*)(?:edges\[(\d+)\])?")


@dataclass(frozen=True, slots=True)
class _Block:
    """The lines of one state, or of the machine itself, up to those of the next.

    Attributes:
        place: such as ``states[2].states[0]``; empty for the machine.
        path: of the state.
        first: number of its first line, from 1.
        lines: its text.

    """

    place: str
    path: str
    first: int
    lines: tuple[str, ...]

    def edge_line(self, number: int) -> int:
        """Line of an edge of it by its place in the list; its own first line if it is not found."""
        found = [self.first + i for i, line in enumerate(self.lines) if _EDGE.search(line)]
        return found[number] if number < len(found) else self.first

    def naming(self, *names: str) -> int | None:
        """The first line of an edge that names all these."""
        for i, line in enumerate(self.lines):
            if _EDGE.search(line) and all(re.search(rf"[\"']{re.escape(name)}[\"']", line) for name in names):
                return self.first + i
        return None


def with_lines(text: str, where: str, problems: Iterable[Problem]) -> tuple[Problem, ...]:
    """Problems of a table or of the checks with file and line before their places, in the order of lines."""
    blocks = _blocks(text)
    lines = [(_line(blocks, problem.where) or 0, problem) for problem in problems]
    return tuple(
        Problem(f"{where}:{line}: {p.where}" if line else f"{where}: {p.where}", p.what, p.hint)
        for line, p in sorted(lines, key=lambda found: found[0])
    )


def _line(blocks: tuple[_Block, ...], where: str) -> int | None:
    if where.startswith("machine "):
        return _line_of_path(blocks, where.split(": ")[1:])
    found = _PLACE.match(where)
    assert found is not None
    block = next((b for b in blocks if b.place == found[1].rstrip(".")), None)
    if block is None:
        return None
    if found[2]:
        return block.edge_line(int(found[2]))
    return block.first if block.place else None


def _line_of_path(blocks: tuple[_Block, ...], parts: list[str]) -> int | None:
    """Of a place such as ``arm/grip: slipped: …`` as the checks write it."""
    by_path = {block.path: block for block in blocks if block.path}
    block = by_path.get(parts[0]) if parts else None
    if not parts or block is None:
        return None
    around, _, name = parts[0].rpartition("/")
    container = by_path.get(around) if around else blocks[0]
    edge = container.naming(name, parts[1]) if container and len(parts) > 1 else None
    return edge or block.first


def _blocks(text: str) -> tuple[_Block, ...]:
    lines = text.split("\n")
    starts = [i for i, line in enumerate(lines) if _HEADER.match(line)]
    blocks = [_Block("", "", 1, tuple(lines[: starts[0] if starts else len(lines)]))]
    counts: list[int] = []
    names: list[str] = []
    for start, end in pairwise((*starts, len(lines))):
        header = _HEADER.match(lines[start])
        assert header is not None
        depth = header[1].count("states")
        counts = [*counts[: depth + 1], *[-1] * (depth + 1 - len(counts))]
        counts[depth] += 1
        names = [*names[:depth], _name(lines[start:end])]
        place = ".".join(f"states[{n}]" for n in counts)
        path = ""
        for name in names:
            path = join(path, name)
        blocks.append(_Block(place, path, start + 1, tuple(lines[start:end])))
    return tuple(blocks)


def _name(lines: list[str]) -> str:
    found = next((match for line in lines if (match := _NAME.match(line))), None)
    try:
        return str(tomllib.loads(f"name = {found[1]}")["name"]) if found else ""
    except tomllib.TOMLDecodeError:
        return ""
