"""Many logs at once: the frames of one, with a column that says which log a row is from.

All logs are read once, when they are opened. Kept of each are the bytes of its records without the robot's samples,
some 30 kB a run; frames are made of them when they are asked for. ``plant`` and ``joints``, ten times as much, read the
files again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from teleop_sim.core.errors import LogDamaged, Problem, UnknownName
from teleop_sim.core.records import RECORDS
from teleop_sim.log.derived import blackout_frame, runs_frame
from teleop_sim.log.frames import Frames
from teleop_sim.log.gathering import BULK, Gathering, Member, find_logs
from teleop_sim.log.load import Log, open_log
from teleop_sim.log.loops import Longs
from teleop_sim.log.store import Messages, Table, misfits, records, table
from teleop_sim.log.tidy import PARTS, tidy

if TYPE_CHECKING:
    import pandas as pd


def load_many(path: Path | str | Sequence[Path | str]) -> Logs:
    """Open many logs.

    Args:
        path: of a directory, that of a sweep too, or a list of logs and directories.

    Raises:
        LogDamaged: there is no log.

    """
    paths = [Path(path)] if isinstance(path, str | Path) else [Path(each) for each in path]
    found, problems = find_logs(paths)
    gathering = Gathering(problems=problems)
    for each in found:
        gathering.add(each)
    if not gathering.members:
        why = "; ".join(f"{Path(p.where).name}: {p.what}" for p in gathering.problems[:3])
        where = ", ".join(map(str, paths[:3]))
        raise LogDamaged(
            where or "[]", f"no log in this {'directory' if len(paths) == 1 else 'list'}" + f" ({why})" * bool(why)
        )
    return Logs(tuple(gathering.members), tuple(gathering.problems), gathering.messages())


@dataclass(frozen=True, eq=False)
class Logs(Frames):
    """Many runs' logs, with the frames of one.

    In front of a frame's own columns stand ``log`` (categorical: the file's name from the directory) and, of a sweep,
    ``cell``, ``replicate`` and its factors; a factor whose name the frame has already is called ``cell_<name>``.

    Attributes:
        members: the logs, in the order of their names.

    """

    members: tuple[Member, ...]
    _problems: tuple[Problem, ...] = field(repr=False)
    _messages: Messages = field(repr=False)
    _left_out: dict[Problem, None] = field(default_factory=dict, repr=False)

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Files that are no logs, and what is wrong with them; logs that a frame so far had to leave out."""
        return (*self._problems, *self._left_out)

    def __len__(self) -> int:
        """How many logs there are."""
        return len(self.members)

    def __iter__(self) -> Iterator[Log]:
        """The logs one by one, each opened when its turn comes."""
        return (open_log(member.path) for member in self.members)

    def frame(self, topic: str) -> pd.DataFrame:
        """Any topic as a frame of all logs; see ``Frames``."""
        if topic not in RECORDS:
            raise UnknownName("topic", topic, tuple(sorted(RECORDS)))
        if topic in BULK:
            return self._concatenated([log.frame(topic) for log in self])
        found, _ = self._table(topic)
        return self._labelled(tidy(topic, found.columns, found.times_ns), found.sources)

    @cached_property
    def runs(self) -> pd.DataFrame:
        """One row a run: what was run and how it ended. Of an interrupted run, what is not known is missing (NA)."""
        started, ended = self._firsts("run/started"), self._firsts("run/ended")
        rows = []
        for source, member in enumerate(self.members):
            end = ended.get(source)
            end_s = member.last_ns / 1e9 if end is None else end["t_s"]
            rows.append({**started.get(source, {}), **(end or {}), "interrupted": end is None, "end_s": end_s})
        return self._labelled(runs_frame(rows), np.arange(len(rows)))

    @cached_property
    def blackouts(self) -> pd.DataFrame:
        """One row a blackout: direction, start_s, end_s (NaN: still dark when the log ends), t, took."""
        found, _ = self._table("link/blackout")
        return self._labelled(*blackout_frame(tidy("link/blackout", found.columns, found.times_ns), found.sources))

    @cached_property
    def plant(self) -> pd.DataFrame:
        """One row a sample, indexed by ``t``; NaN where a robot has no joint of that name. Reads the files again."""
        return self._concatenated([log.plant for log in self])

    @cached_property
    def joints(self) -> pd.DataFrame:
        """One row a sample, indexed by ``t``: every joint by its name [rad or m]. Reads the files again."""
        return self.plant.drop(columns=["t_s", *PARTS["pelvis"]])

    def _firsts(self, topic: str) -> dict[int, dict[str, Any]]:
        """Of each log that has one, its first record of a topic."""
        found, messages = self._table(topic)
        made: dict[int, dict[str, Any]] = {}
        for source, record in zip(found.sources.tolist(), records(messages, self._name, topic), strict=True):
            made.setdefault(source, vars(record))
        return made

    @property
    def _name(self) -> str:
        return f"{len(self)} logs"

    def _table(self, topic: str) -> tuple[Table, Messages]:
        """One topic of all logs but those of which a record does not fit; these are a problem each."""
        try:
            return table(self._messages, topic, self._name), self._messages
        except LogDamaged:
            bad = misfits(self._messages, topic)
        what = f"a record of {topic} does not fit its schema"
        told = (Problem(str(self.members[n].path), what, "The log is left out of that frame.") for n in sorted(bad))
        self._left_out.update(dict.fromkeys(told))
        others = self._messages.without(bad)
        return table(others, topic, self._name), others

    def _concatenated(self, frames: list[pd.DataFrame]) -> pd.DataFrame:
        import pandas as pd

        sources = np.repeat(np.arange(len(frames)), [len(frame) for frame in frames])
        return self._labelled(pd.concat(frames), sources)

    def _labelled(self, frame: pd.DataFrame, sources: Longs) -> pd.DataFrame:
        """A frame with the columns that say which log each row is from."""
        import pandas as pd

        names = pd.CategoricalDtype(pd.Index([member.name for member in self.members], dtype="str"))
        made: dict[str, Any] = {"log": pd.Categorical.from_codes(sources.astype(np.int32), dtype=names)}
        for name, values in self._labels.items():
            if name == "replicate" and name in frame:
                frame = frame.drop(columns=name)
            made[f"cell_{name}" if name in frame else name] = values.take(sources)
        return pd.concat([pd.DataFrame(made, index=frame.index), frame], axis=1)

    @cached_property
    def _labels(self) -> dict[str, Any]:
        """Column to its value of each log; text is categorical."""
        import pandas as pd

        names = dict.fromkeys(name for member in self.members for name in member.labels)
        made = {}
        for name in names:
            values = pd.Series([_value(member.labels.get(name)) for member in self.members])
            made[name] = values.astype("category").array if values.dtype in ("object", "str") else values.array
        return made


def _value(value: object) -> object:
    """A list of a scenario file is a factor's value like any other."""
    return str(value) if isinstance(value, list | tuple | dict) else value
