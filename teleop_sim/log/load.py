"""Read a log: records, or tidy DataFrames.

Whatever is whole is read: a log that was cut off at any byte, a ``.part`` that a killed run left, a finished file.
Nothing in a log is ever executed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from google.protobuf.message import DecodeError

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import RECORDS, Blackout, Record
from teleop_sim.log.scan import RawMessage, Scan, scan
from teleop_sim.log.schema import SCHEMAS, decoder, field_types

if TYPE_CHECKING:
    import pandas as pd


def load(path: Path | str) -> Log:
    """Open a log.

    Args:
        path: of a ``.mcap`` or ``.mcap.part`` file, whole or cut off.

    Raises:
        LogDamaged: there is no such file, it is no log, or not one record in it is whole.

    """
    if Path(path).is_char_device() or Path(path).is_block_device():
        raise LogDamaged(str(path), "a device, not a log")  # /dev/zero has no end
    try:
        found = scan(Path(path).read_bytes())
    except OSError as error:
        raise LogDamaged(str(path), _why(Path(path), error)) from error
    except ValueError as error:
        raise LogDamaged(str(path), f"{error}; a log is a .mcap file that teleop-sim run has written") from error
    ours = tuple(m for m in found.messages if m.topic in RECORDS)
    if not ours and not found.whole:
        raise LogDamaged(str(path), "cut off before its first record")
    if not ours:
        raise LogDamaged(str(path), "an MCAP file, but none of its topics are teleop-sim's")
    return Log(Path(path), found.whole, ours, _decoders(str(path), found))


@dataclass(frozen=True, eq=False)
class Log:
    """One run's log. Records are decoded when first asked for, topic by topic.

    Attributes:
        path: of the file.
        whole: the file's end was reached. A file may lack its end and yet hold the whole run.

    """

    path: Path
    whole: bool
    _messages: tuple[RawMessage, ...] = field(repr=False)
    _decode: dict[tuple[str, int], Callable[[bytes], Record]] = field(repr=False)

    def records(self, topic: str | None = None) -> Iterator[Record]:
        """All records, or those of one topic, in the order in which they were written.

        Raises:
            LogDamaged: a record does not fit its schema.

        """
        for message in self._messages if topic is None else self._by_topic.get(topic, ()):
            try:
                yield self._decode[message.topic, message.schema_id](message.data)
            except (DecodeError, KeyError) as error:
                raise LogDamaged(str(self.path), f"a record of {message.topic} does not fit its schema") from error

    @property
    def scenario_toml(self) -> str:
        """The whole scenario after overrides; empty if the log does not say."""
        return str(self._started.get("scenario_toml", ""))

    @property
    def interrupted(self) -> bool:
        """The run did not end by itself."""
        return "run/ended" not in self._by_topic

    @property
    def end_s(self) -> float:
        """Time of the last record [s]."""
        return max(m.time_ns for m in self._messages) * 1e-9 if self.interrupted else float(self._ended["t_s"])

    @cached_property
    def runs(self) -> pd.DataFrame:
        """One row: what was run and how it ended. Of an interrupted run, what is not known is missing (NA)."""
        import pandas as pd

        started = {n: self._started.get(n) for n in ("scenario", "seed", "replicate", "time_limit_s", "versions")}
        names = ("outcome", "cause", "completion_time_s", "round_trips", "operator_acts")
        ended = {n: self._ended.get(n) for n in names}
        row = {**started, **ended, "interrupted": self.interrupted, "end_s": self.end_s}
        whole = dict.fromkeys(("seed", "replicate", "round_trips", "operator_acts"), "Int64")
        real = dict.fromkeys(("time_limit_s", "completion_time_s", "end_s"), "float64")
        text = dict.fromkeys(("scenario", "versions", "outcome", "cause"), "str")
        return pd.DataFrame([row]).astype({**whole, **real, **text})

    @cached_property
    def packets(self) -> pd.DataFrame:
        """One row a packet whose fate is known; columns of ``PacketEnded``."""
        return self._frame("link/packet")

    @cached_property
    def messages(self) -> pd.DataFrame:
        """One row a message whose delivery repeats or acknowledges; columns of ``MessageEnded``."""
        return self._frame("link/message")

    @cached_property
    def transitions(self) -> pd.DataFrame:
        """One row a transition of the machine, self-loops too; columns of ``TransitionTaken``."""
        return self._frame("machine/transition")

    @cached_property
    def modes(self) -> pd.DataFrame:
        """One row a change of the machine's mode; columns of ``ModeChanged``."""
        return self._frame("machine/mode")

    @cached_property
    def requests(self) -> pd.DataFrame:
        """One row a request to the operator; columns of ``Requested``."""
        return self._frame("machine/request")

    @cached_property
    def released(self) -> pd.DataFrame:
        """One row a command that arrived at the field site; columns of ``Released``."""
        return self._frame("machine/released")

    @cached_property
    def acts(self) -> pd.DataFrame:
        """One row a thing the operator did; columns of ``OperatorActed``."""
        return self._frame("operator/act")

    @cached_property
    def layers(self) -> pd.DataFrame:
        """One row a work of the crew at a layer of control below a behaviour; columns of ``Layer``."""
        return self._frame("operator/layer")

    @cached_property
    def judgements(self) -> pd.DataFrame:
        """One row a claim that the crew compared with what had arrived; columns of ``Judged``."""
        return self._frame("operator/judgement")

    @cached_property
    def episodes(self) -> pd.DataFrame:
        """One row a skill from start to rest; columns of ``EpisodeEnded``."""
        return self._frame("field/episode")

    @cached_property
    def waits(self) -> pd.DataFrame:
        """One row a wait at the field site; columns of ``Waited``."""
        return self._frame("field/wait")

    @cached_property
    def disturbances(self) -> pd.DataFrame:
        """One row a figure of what went otherwise than the robot believed; columns of ``Disturbed``."""
        return self._frame("field/disturbance")

    @cached_property
    def scores(self) -> pd.DataFrame:
        """One row a finding of the task's scorer; columns of ``Scored``."""
        return self._frame("task/score")

    @cached_property
    def blackouts(self) -> pd.DataFrame:
        """One row a blackout: direction, start_s, end_s (NaN: still dark when the log ends)."""
        import pandas as pd

        rows: list[dict[str, Any]] = []
        dark: dict[str, int] = {}
        for change in self.records("link/blackout"):
            assert isinstance(change, Blackout)
            if change.dark and change.direction not in dark:
                dark[change.direction] = len(rows)
                rows.append({"direction": change.direction, "start_s": change.t_s, "end_s": float("nan")})
            elif not change.dark and change.direction in dark:
                rows[dark.pop(change.direction)]["end_s"] = change.t_s
        columns = {"direction": "str", "start_s": "float64", "end_s": "float64"}
        return pd.DataFrame(rows, columns=list(columns)).astype(columns)

    @cached_property
    def plant(self) -> pd.DataFrame:
        """One row a sample: t_s, pelvis position [m] and quaternion, then every joint [rad or m] by name."""
        import pandas as pd

        samples = self._frame("field/plant")
        named = [str(names).split() for names in self._frame("field/plant_names")["joints"]]
        joints = named[-1] if named else []
        width = max((len(row) for row in samples["joints"]), default=len(joints))
        joints = joints + [f"joint_{i}" for i in range(len(joints), width)]
        wide = [
            (t_s, *_padded(pelvis, len(_PELVIS)), *_padded(angles, len(joints)))
            for t_s, pelvis, angles in zip(samples["t_s"], samples["pelvis"], samples["joints"], strict=True)
        ]
        return pd.DataFrame(wide, columns=["t_s", *_PELVIS, *joints], dtype="float64")

    @cached_property
    def _by_topic(self) -> dict[str, tuple[RawMessage, ...]]:
        ordered = sorted(self._messages, key=lambda m: m.topic)
        return {topic: tuple(group) for topic, group in groupby(ordered, key=lambda m: m.topic)}

    @cached_property
    def _started(self) -> dict[str, Any]:
        return vars(next(self.records("run/started"), None) or _Nothing())

    @cached_property
    def _ended(self) -> dict[str, Any]:
        return vars(next(self.records("run/ended"), None) or _Nothing())

    def _frame(self, topic: str) -> pd.DataFrame:
        import pandas as pd

        dtypes = _DTYPES[topic]
        rows = [tuple(vars(record).values()) for record in self.records(topic)]
        return pd.DataFrame(rows, columns=list(dtypes)).astype(dtypes)


class _Nothing:
    """No such record: nothing is known."""


_PELVIS = tuple(f"pelvis_{n}" for n in ("x", "y", "z", "qw", "qx", "qy", "qz"))
_PANDAS = {float: "float64", int: "int64", bool: "bool", str: "str"}
_DTYPES = {
    topic: {name: _PANDAS.get(hint, "object") for name, hint in field_types(cls).items()}
    for topic, cls in RECORDS.items()
}


def _padded(values: tuple[float, ...], size: int) -> tuple[float, ...]:
    return (*values[:size], *(float("nan"),) * (size - len(values)))


def _decoders(path: str, found: Scan) -> dict[tuple[str, int], Callable[[bytes], Record]]:
    """Topic and schema id to decoder: ours where the file's schema is ours, one made from the file's own otherwise."""
    made: dict[tuple[str, int], Callable[[bytes], Record]] = {}
    for topic, schema_id in sorted(set(found.channels.values())):
        name, data = found.schemas.get(schema_id, ("", b""))
        ours = SCHEMAS.get(topic)
        if ours is None:
            continue
        try:
            made[topic, schema_id] = ours.decode if data == ours.data else decoder(data, name, ours.cls)
        except ValueError as error:
            raise LogDamaged(path, f"the schema of {topic} cannot be used: {error}") from error
    return made


def _why(path: Path, error: OSError) -> str:
    if path.is_dir():
        return "a directory, not a log"
    part = path.with_name(path.name + ".part")
    if not path.exists() and part.exists():
        return f"no such file; what an unfinished run has written so far is in {part.name}"
    return "no such file" if isinstance(error, FileNotFoundError) else f"cannot be read: {error.strerror}"
