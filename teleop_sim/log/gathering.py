"""Find the logs in directories, and gather their records, without the robot's samples, into one place."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from teleop_sim.core.errors import LogDamaged, Problem
from teleop_sim.log.found import Block, Scan
from teleop_sim.log.loops import Longs, compiled, gather
from teleop_sim.log.opening import kinds_of, open_scan
from teleop_sim.log.scan import BLOCK_BYTES
from teleop_sim.log.store import Kind, Messages

BULK = frozenset({"field/plant"})
"""Topics that are not gathered: nine tenths of a log's bytes."""

MANIFEST = "sweep.json"
"""Of a sweep's directory (teleop_sim/sweep/folder.py)."""

Labels = Mapping[str, Any]


@dataclass(frozen=True)
class Found:
    """A file that may be a log: its name from the directory, and what is known of its run beforehand."""

    path: Path
    name: str
    labels: Labels


@dataclass(frozen=True)
class Member:
    """One of many logs.

    Attributes:
        path: of the file.
        name: from the directory.
        labels: cell, replicate and factors, where it belongs to a sweep.
        whole: the file's end was reached.
        last_ns: time of its last record.

    """

    path: Path
    name: str
    labels: Labels
    whole: bool
    last_ns: int


@dataclass
class Gathering:
    """The logs so far, what was no log, and all records."""

    members: list[Member] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    kinds: dict[Kind, int] = field(default_factory=dict)
    blocks: list[Block] = field(default_factory=list)
    sources: list[Longs] = field(default_factory=list)
    _data: list[Any] = field(default_factory=list)
    _notes: list[Longs] = field(default_factory=list)
    _size: int = 0

    def add(self, found: Found) -> None:
        """Take in a log, or note why it is none."""
        try:
            scanned = open_scan(found.path)
        except LogDamaged as error:
            self.problems.append(Problem(str(found.path), str(error.args[1])))
            return
        last_ns = max(int(block.times_ns.view(np.uint64).max()) for block in scanned.blocks)
        self._take(scanned, len(self.members))
        self.members.append(Member(found.path, found.name, found.labels, scanned.whole, last_ns))

    def messages(self) -> Messages:
        """All records."""
        self._flush()
        return Messages(tuple(self.kinds), tuple(self.blocks), tuple(self.sources))

    def _take(self, scanned: Scan, source: int) -> None:
        kinds = kinds_of(scanned)
        numbers = np.array([self.kinds.setdefault(kind, len(self.kinds)) for kind in kinds], dtype=np.int64)
        small = np.array([kind.topic not in BULK for kind in kinds])
        for block in scanned.blocks:
            notes = np.concatenate([block.notes, np.full((1, len(block.kinds)), source)])[:, small[block.kinds]]
            data = np.empty(int(notes[4].sum()), dtype=np.uint8)
            offsets = np.zeros(notes.shape[1] + 1, dtype=np.int32)
            compiled(gather)(block.data, notes[3], notes[4], data, offsets)
            notes[0], notes[3] = numbers[notes[0]], offsets[:-1] + self._size
            self._data.append(data)
            self._notes.append(notes)
            self._size += len(data)
        if self._size >= BLOCK_BYTES:
            self._flush()

    def _flush(self) -> None:
        if not self._data:
            return
        notes = np.concatenate(self._notes, axis=1)
        self.blocks.append(Block(np.concatenate(self._data), np.ascontiguousarray(notes[:5])))
        self.sources.append(notes[5].copy())
        self._data, self._notes, self._size = [], [], 0


def find_logs(paths: Sequence[Path]) -> tuple[list[Found], list[Problem]]:
    """The logs at some paths: files as they are, those in directories in the order of their names."""
    found: list[Found] = []
    problems: list[Problem] = []
    # What is common to all goes without saying; a single path is that itself.
    root = paths[0] if len(paths) == 1 else Path(os.path.commonpath([str(path.absolute()) for path in paths] or ["/"]))
    for path in paths:
        if not path.is_dir():
            found.append(Found(path, _name(path, root), {}))
            continue
        labels, broken = _sweep_labels(path)
        problems += broken
        for file in _files(path):
            if file.name.endswith(".part") and file.with_suffix("").exists():
                problems.append(Problem(str(file), "left out: there is a finished log of that name"))
                continue
            found.append(Found(file, _name(file, root), labels.get(str(file.relative_to(path)), {})))
    return found, problems


def _name(path: Path, root: Path) -> str:
    try:
        return str(path.absolute().relative_to(root.absolute()))
    except ValueError:
        return str(path)


def _files(directory: Path) -> Iterator[Path]:
    """Files that are called as logs are, at any depth, by name."""
    for folder, below, names in os.walk(directory):
        below.sort()
        yield from (Path(folder) / name for name in sorted(names) if name.endswith((".mcap", ".mcap.part")))


def _sweep_labels(directory: Path) -> tuple[dict[str, Labels], list[Problem]]:
    """Name of a log in a sweep's directory to its cell, replicate and factors; nothing where it is no sweep."""
    manifest = directory / MANIFEST
    try:
        told = json.loads(manifest.read_text(encoding="utf-8"))
        names = [str(factor["name"]) for factor in told["factors"]]
        cells = [dict(zip(names, cell, strict=True)) for cell in told["cells"]]
        replicates = range(int(told["replicates"]))
    except FileNotFoundError:
        return {}, []
    except (OSError, ValueError, KeyError, TypeError) as error:
        return {}, [Problem(str(manifest), f"does not read: {error}", "Its runs are loaded without their factors.")]
    labels: dict[str, Labels] = {
        f"runs/c{cell:04d}/r{replicate:05d}{end}": {"cell": cell, "replicate": replicate, **values}
        for cell, values in enumerate(cells)
        for replicate in replicates
        for end in (".mcap", ".mcap.part")
    }
    return labels, []
