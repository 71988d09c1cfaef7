"""A sweep's directory: manifest, logs, journals and index, of which none is ever half.

    DIR/sweep.json            the manifest: plan, versions, state of the program's repository
    DIR/runs/c0007/r00003.mcap     one log a run, renamed into place when it is whole
    DIR/journal/r00003.jsonl  one line a finished run of replicate 3, appended when its log is in place
    DIR/states.parquet        one row a state of a finished run, written from the journals and renamed into place
    DIR/times.parquet         of a door or valve: the columns of Table 2, one row a finished run, likewise
    DIR/index.parquet         one row a finished run, likewise; the last of the three, which count only beside it

A process that is killed at any instant leaves at most the runs in flight unfinished: a run is finished when its line is
whole, and the line is written after the log. A line that was cut has no valid checksum and does not count.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final
from zlib import crc32

from teleop_sim.core.errors import BadInput, Problem, TeleopError
from teleop_sim.sweep.plan import Plan, from_json, to_json
from teleop_sim.sweep.versions import git_state, versions

MANIFEST: Final = "sweep.json"
INDEX: Final = "index.parquet"
STATE_INDEX: Final = "states.parquet"
TIME_INDEX: Final = "times.parquet"
STATES: Final = "states"
"""Key of a row: the states of a run, see ``reports.state_counts.plain``."""
TIMES: Final = "times"
"""Key of a row of a door or valve: the fields of ``reports.drc_times.Times``, null where not known."""
_CHECKSUM: Final = 9  # eight hexadecimal digits and a space

Row = dict[str, Any]


class SweepBroken(TeleopError):
    """A directory is no sweep, or one that this version cannot go on with.

    Args:
        where: the directory or file.
        what: is wrong with it.
        hint: what would do.

    """

    def __init__(self, where: str, what: str, hint: str) -> None:
        super().__init__(where, what, hint)
        self.where, self.what, self.hint = where, what, hint

    def __str__(self) -> str:
        return f"{self.where}: {self.what}\n  {self.hint}"


@dataclass(frozen=True)
class SweepFolder:
    """The files of one sweep. Holds no open file: any process makes its own of a path."""

    path: Path

    @property
    def manifest(self) -> Path:
        """The plan and what it was run with."""
        return self.path / MANIFEST

    @property
    def index(self) -> Path:
        """One row a finished run."""
        return self.path / INDEX

    @property
    def states(self) -> Path:
        """One row a state of a finished run."""
        return self.path / STATE_INDEX

    @property
    def times(self) -> Path:
        """One row a finished run of a door or valve."""
        return self.path / TIME_INDEX

    def log(self, cell: int, replicate: int) -> Path:
        """Where a run's log is."""
        return self.path / "runs" / f"c{cell:04d}" / f"r{replicate:05d}.mcap"

    def journal(self, replicate: int) -> Path:
        """The finished runs of a replicate."""
        return self.path / "journal" / f"r{replicate:05d}.jsonl"

    def create(self, plan: Plan) -> None:
        """Begin a sweep here.

        Raises:
            BadInput: one is here already.

        """
        if self.manifest.exists():
            hint = f"Go on with it: teleop-sim sweep --resume {self.path}; or give another --out."
            raise BadInput((Problem(str(self.path), "holds a sweep already", hint),))
        self.path.mkdir(parents=True, exist_ok=True)
        self.write_manifest(plan)

    def write_manifest(self, plan: Plan) -> None:
        """Write the manifest with the present versions."""
        values = to_json(plan) | {"versions": versions(), "git": git_state()}
        replace_with(self.manifest, (json.dumps(values, indent=1) + "\n").encode())

    def read(self) -> tuple[Plan, dict[str, str]]:
        """The plan and the versions that it was run with.

        Raises:
            SweepBroken: there is no manifest, or it does not read.

        """
        try:
            values = json.loads(self.manifest.read_text(encoding="utf-8"))
            return from_json(values), {str(k): str(v) for k, v in values["versions"].items()}
        except OSError as error:
            hint = "Give the directory that teleop-sim sweep wrote."
            raise SweepBroken(str(self.path), f"no sweep: {MANIFEST}: {error.strerror}", hint) from None
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise SweepBroken(
                str(self.manifest), f"does not read: {error}", "It is written by teleop-sim sweep; put it back."
            ) from None

    def finished(self, replicate: int) -> dict[int, Row]:
        """Cell to row of the finished runs of a replicate."""
        try:
            data = self.journal(replicate).read_bytes()
        except FileNotFoundError:
            return {}
        rows = (row for line in data.split(b"\n") if (row := _checked(line)) is not None)
        return {int(row["cell"]): row for row in rows}

    def whole(self, replicate: int) -> dict[int, Row]:
        """As ``finished``, without runs whose log is not there as it was written: removed, or lost with the power."""

        def there(row: Row) -> bool:
            path = self.path / row["log"]
            return not row["log"] or (path.is_file() and path.stat().st_size == row["log_bytes"])

        return {cell: row for cell, row in self.finished(replicate).items() if there(row)}

    def count(self, replicate: int) -> int:
        """About how many runs of a replicate are finished: cheap, for progress."""
        try:
            return self.journal(replicate).read_bytes().count(b"\n")
        except FileNotFoundError:
            return 0

    def rows(self, replicates: int) -> list[Row]:
        """All finished runs by cell and replicate."""
        found = [row for replicate in range(replicates) for row in self.finished(replicate).values()]
        return sorted(found, key=lambda row: (row["cell"], row["replicate"]))

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Hold the sweep: two at once in one directory would do all work twice.

        Raises:
            BadInput: another process holds it.

        """
        self.path.mkdir(parents=True, exist_ok=True)
        with (self.path / ".lock").open("ab") as held:
            _lock(held, str(self.path))
            yield

    @contextmanager
    def journalling(self, replicate: int) -> Iterator[IO[bytes]]:
        """A replicate's journal, open for ``append``; waits while another process writes it."""
        path = self.journal(replicate)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab") as stream:
            fcntl.flock(stream, fcntl.LOCK_EX)
            # A line that a kill has cut stays behind, ended, and does not count.
            if stream.tell() and not _ends_whole(path):
                stream.write(b"\n")
                stream.flush()
            yield stream


def append(stream: IO[bytes], row: Mapping[str, Any]) -> None:
    """Add one finished run to a journal."""
    line = json.dumps(row, separators=(",", ":"), ensure_ascii=True).encode()
    stream.write(b"%08x %s\n" % (crc32(line), line))
    stream.flush()


def replace_with(path: Path, data: bytes) -> None:
    """Write a file aside and rename it into place: it is either the old one or the new one."""
    aside = path.with_name(f"{path.name}.{os.getpid()}.part")
    with aside.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    aside.replace(path)


def _checked(line: bytes) -> Row | None:
    if len(line) <= _CHECKSUM or line[: _CHECKSUM - 1] != b"%08x" % crc32(line[_CHECKSUM:]):
        return None
    row: Row = json.loads(line[_CHECKSUM:])
    return row


def _ends_whole(path: Path) -> bool:
    with path.open("rb") as stream:
        stream.seek(-1, os.SEEK_END)
        return stream.read(1) == b"\n"


def _lock(stream: IO[bytes], where: str) -> None:
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BadInput((Problem(where, "another sweep is under way here", "Wait for its end."),)) from None
    except OSError:  # a file system without locks
        pass
