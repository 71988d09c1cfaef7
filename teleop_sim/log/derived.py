"""Frames that are no plain list of one topic's records: runs, blackouts, and the plant's samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from teleop_sim.log.columns import Ragged
from teleop_sim.log.loops import Longs
from teleop_sim.log.store import Table
from teleop_sim.log.tidy import PARTS, from_seconds, matrix, timedeltas

if TYPE_CHECKING:
    import pandas as pd

STARTED = ("scenario", "seed", "replicate", "time_limit_s", "versions")
ENDED = ("outcome", "cause", "completion_time_s", "round_trips", "operator_acts")

_RUN_TYPES = {
    **dict.fromkeys(("seed", "replicate", "round_trips", "operator_acts"), "Int64"),
    **dict.fromkeys(("time_limit_s", "completion_time_s", "end_s"), "float64"),
    **dict.fromkeys(("scenario", "versions", "outcome", "cause"), "str"),
    "interrupted": "bool",
}


def runs_frame(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row a run: what was run and how it ended; of an interrupted one what is not known is missing (NA).

    ``t`` is ``end_s`` as a timedelta.
    """
    import pandas as pd

    columns = [*STARTED, *ENDED, "interrupted", "end_s"]
    made = pd.DataFrame([{name: row.get(name) for name in columns} for row in rows], columns=columns)
    made = made.astype(_RUN_TYPES).astype(dict.fromkeys(("scenario", "outcome"), "category"))
    return made.assign(t=from_seconds(made["end_s"].to_numpy()))


def blackout_frame(changes: pd.DataFrame, sources: Longs | None) -> tuple[pd.DataFrame, Longs]:
    """One row a blackout: direction, start_s, end_s, t, took; NaN and NaT: still dark. And which file each is from.

    Args:
        changes: of the link, in order; a direction that goes dark twice without coming back is dark once.
        sources: which file each is from; None: all are from one.

    """
    files = [0] * len(changes) if sources is None else sources.tolist()
    rows: list[dict[str, Any]] = []
    dark: dict[tuple[int, str], int] = {}
    named = changes[["direction", "dark", "t_s", "t"]].itertuples(index=False, name=None)
    for file, (direction, now_dark, t_s, t) in zip(files, named, strict=True):
        which = (file, direction)
        if now_dark and which not in dark:
            dark[which] = len(rows)
            rows.append({"direction": direction, "start_s": t_s, "end_s": np.nan, "t": t, "took": None, "file": file})
        elif not now_dark and which in dark:
            row = rows[dark.pop(which)]
            row |= {"end_s": t_s, "took": t - row["t"]}
    made = _blackouts_of(rows)
    made["direction"] = made["direction"].astype(changes["direction"].dtype)
    return made, np.array([row["file"] for row in rows], dtype=np.int64)


def _blackouts_of(rows: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    times = dict.fromkeys(("t", "took"), "timedelta64[ns]")
    types = {"direction": "str", "start_s": "float64", "end_s": "float64", **times}
    return pd.DataFrame(rows, columns=list(types)).astype(types)


def plant_frame(samples: Table, names: Sequence[str]) -> pd.DataFrame:
    """One row a sample, indexed by ``t``: t_s, the pelvis, then every joint by name; NaN where a sample has less.

    Args:
        samples: of ``field/plant``.
        names: of the joints; joints beyond these are called by number.

    """
    import pandas as pd

    joints: Ragged = samples.columns["joints"]
    pelvis: Ragged = samples.columns["pelvis"]
    width = max(joints.width, len(names))
    named = [*names, *(f"joint_{i}" for i in range(len(names), width))]
    values = matrix([(pelvis, len(PARTS["pelvis"])), (joints, width)], len(samples.times_ns), before=1)
    values[:, 0] = samples.columns["t_s"]
    index = pd.TimedeltaIndex(timedeltas(samples.times_ns), name="t")
    return pd.DataFrame(values, columns=["t_s", *PARTS["pelvis"], *named], index=index, copy=False)
