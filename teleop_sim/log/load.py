"""Read a log: records, or tidy DataFrames.

Whatever is whole is read: a log that was cut off at any byte, a ``.part`` that a killed run left, a finished file.
Nothing in a log is ever executed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from teleop_sim.core.errors import UnknownName
from teleop_sim.core.records import RECORDS, Record
from teleop_sim.log.derived import blackout_frame, plant_frame, runs_frame
from teleop_sim.log.frames import Frames
from teleop_sim.log.opening import kinds_of, open_scan
from teleop_sim.log.store import Messages, Table, records, table
from teleop_sim.log.tidy import PARTS, tidy

if TYPE_CHECKING:
    import pandas as pd

    from teleop_sim.log.many import Logs


@overload
def load(path: Path | str) -> Log: ...
@overload
def load(path: list[Path | str] | list[Path] | list[str] | tuple[Path | str, ...]) -> Logs: ...
def load(path: Path | str | Sequence[Path | str]) -> Log | Logs:
    """Open a log; or, given a directory or a list of paths, many logs at once, with the same frames.

    Args:
        path: of a ``.mcap`` or ``.mcap.part`` file, whole or cut off; a directory (for a type checker:
            ``teleop_sim.log.many.load_many``), that of a sweep too; or a list of either.

    Raises:
        LogDamaged: there is no such file, it is no log, or not one record in it is whole; there is no log in the
            directory.

    """
    if isinstance(path, str | Path) and not Path(path).is_dir():
        return open_log(Path(path))
    from teleop_sim.log.many import load_many

    return load_many(path)


def open_log(path: Path) -> Log:
    """Open one log.

    Raises:
        LogDamaged: there is no such file, it is no log, or not one record in it is whole.

    """
    found = open_scan(path)
    blocks = tuple(found.blocks)
    messages = Messages(kinds_of(found), blocks, tuple(np.zeros_like(block.kinds) for block in blocks))
    return Log(path, found.whole, messages)


@dataclass(frozen=True, eq=False)
class Log(Frames):
    """One run's log. Records are decoded when first asked for, topic by topic.

    Attributes:
        path: of the file.
        whole: the file's end was reached. A file may lack its end and yet hold the whole run.

    """

    path: Path
    whole: bool
    _messages: Messages = field(repr=False)

    def records(self, topic: str | None = None) -> Iterator[Record]:
        """All records, or those of one topic, in the order in which they were written.

        Raises:
            LogDamaged: a record does not fit its schema.

        """
        return records(self._messages, str(self.path), topic)

    def frame(self, topic: str) -> pd.DataFrame:
        """Any topic as a frame; see ``Frames``."""
        found = self._table(topic)
        return tidy(topic, found.columns, found.times_ns)

    @property
    def scenario_toml(self) -> str:
        """The whole scenario after overrides; empty if the log does not say."""
        return str(self._started.get("scenario_toml", ""))

    @property
    def interrupted(self) -> bool:
        """The run did not end by itself."""
        return not self._messages.numbers("run/ended")

    @property
    def end_s(self) -> float:
        """Time of the last record [s]."""
        if not self.interrupted:
            return float(self._ended["t_s"])
        last_ns = (int(block.times_ns.view(np.uint64).max()) for block in self._messages.blocks)
        return max(last_ns, default=0) / 1e9

    @cached_property
    def runs(self) -> pd.DataFrame:
        """One row: what was run and how it ended. Of an interrupted run, what is not known is missing (NA)."""
        return runs_frame([self._run])

    @cached_property
    def blackouts(self) -> pd.DataFrame:
        """One row a blackout: direction, start_s, end_s (NaN: still dark when the log ends), t, took."""
        return blackout_frame(self.frame("link/blackout"), None)[0]

    @cached_property
    def plant(self) -> pd.DataFrame:
        """One row a sample, indexed by ``t``: t_s, pelvis position [m] and quaternion, every joint [rad or m]."""
        named = self.frame("field/plant_names")["joints"]
        return plant_frame(self._table("field/plant"), str(named.iloc[-1]).split() if len(named) else [])

    @cached_property
    def joints(self) -> pd.DataFrame:
        """One row a sample, indexed by ``t``: every joint by its name [rad or m]."""
        return self.plant.iloc[:, 1 + len(PARTS["pelvis"]) :]

    @property
    def _run(self) -> dict[str, Any]:
        return {**self._started, **self._ended, "interrupted": self.interrupted, "end_s": self.end_s}

    @cached_property
    def _started(self) -> dict[str, Any]:
        return vars(next(self.records("run/started"), None) or _Nothing())

    @cached_property
    def _ended(self) -> dict[str, Any]:
        return vars(next(self.records("run/ended"), None) or _Nothing())

    def _table(self, topic: str) -> Table:
        if topic not in RECORDS:
            raise UnknownName("topic", topic, tuple(sorted(RECORDS)))
        return table(self._messages, topic, str(self.path))


class _Nothing:
    """No such record: nothing is known."""
