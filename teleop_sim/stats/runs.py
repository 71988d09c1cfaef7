"""The table of runs, and what is measured on each.

A table has a row a run and these columns beside the factors of the experiment:

========== ======================================================================================================
replicate  number of the repetition; all cells of one replicate share their random numbers
status     ``completed``; ``failed``: it never will (a fall, a refusal); ``censored``: nobody watched long enough
time_s     when it completed, failed or was left [s]
score      points of the task
limit_s    how long the run was to be watched [s]
========== ======================================================================================================

A failed run is not a censored one: more time would not have helped. It counts as "not yet completed" up to its limit,
which makes one minus the survival curve the cumulative incidence of completion with failure as competing event.
Keeping those who met the competing event at risk until their own limit is the "censoring complete" risk set of Fine
and Gray, J. Am. Stat. Assoc. 94 (1999), 496-509. Taking failed runs out of the risk set instead would answer how fast
robots are that cannot fall.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from teleop_sim.core.errors import BadInput, Problem, UnknownName
from teleop_sim.stats.estimate import refuse

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

STATUSES = ("completed", "censored", "failed")
COLUMNS = ("replicate", "status", "time_s", "score", "limit_s")
KINDS = ("time", "success", "score")


@dataclass(frozen=True, slots=True)
class Measure:
    """What a run is judged by.

    Attributes:
        kind: ``time``: completion time restricted to ``limit_s``, where a run that has not completed by then, or
            failed, counts ``limit_s`` (less is better); ``success``: 1 if completed by ``limit_s``, else 0 (more is
            better); ``score``: points of the task (more is better).
        limit_s: restriction or deadline [s]; no meaning for ``score``.

    Raises:
        UnknownName: another kind.
        BadInput: a limit that is not above zero.

    """

    kind: str
    limit_s: float = float("inf")

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise UnknownName("measure", self.kind, KINDS)
        if not self.limit_s > 0.0 or (self.kind == "time" and self.limit_s == float("inf")):
            raise refuse("measure", f"a limit of {self.limit_s} s", "Give a time above zero (finite for 'time').")

    @property
    def sign(self) -> int:
        """+1 where more is better, -1 where less is."""
        return -1 if self.kind == "time" else 1


def check_runs(runs: pd.DataFrame, factors: Sequence[str] = ()) -> None:
    """Refuse a table that is none of runs, naming everything that is wrong with it.

    Raises:
        BadInput: no rows, a column is missing, a status is unknown, a time is negative or no number, or two rows stand
            for the same replicate of the same cell.

    """
    missing = [c for c in (*COLUMNS, *factors) if c not in runs.columns]
    if missing:
        hint = f"Columns here: {', '.join(map(str, runs.columns))}."
        raise BadInput(tuple(Problem("runs", f"no column {name!r}", hint) for name in missing))
    problems = [Problem("runs", "no rows", "Give a row a run.")] if runs.empty else []
    strange = sorted({str(s) for s in runs["status"]} - set(STATUSES))
    problems += [Problem("runs: status", f"unknown status {s!r}", f"Known: {', '.join(STATUSES)}.") for s in strange]
    for name in ("time_s", "limit_s"):
        values = runs[name].to_numpy(dtype=float)
        bad = int((~(np.isfinite(values) & (values >= 0.0))).sum())
        if bad:
            problems.append(Problem(f"runs: {name}", f"{bad} rows without a time", "Give zero or more seconds."))
    doubled = int(runs.duplicated([*factors, "replicate"]).sum())
    if factors and doubled:
        hint = f"Name every factor that varies; named: {', '.join(factors)}."
        problems.append(Problem("runs", f"{doubled} rows repeat a replicate of their cell", hint))
    if problems:
        raise BadInput(tuple(problems))


def common_limit_s(runs: pd.DataFrame) -> float:
    """The longest time that every run was to be watched [s]: the natural restriction of completion times."""
    return float(runs["limit_s"].min())


def follow_up(runs: pd.DataFrame) -> tuple[FloatArray, BoolArray]:
    """How long each run was at risk of completing [s], and whether it did: the input of a survival curve.

    A failed run is at risk until its limit, see the top of this module.
    """
    status = runs["status"].to_numpy(dtype=object)
    time_s, limit_s = (runs[name].to_numpy(dtype=float) for name in ("time_s", "limit_s"))
    return np.where(status == "failed", np.maximum(time_s, limit_s), time_s), status == "completed"


def measured(runs: pd.DataFrame, measure: Measure) -> FloatArray:
    """The value of the measure for each run, shape (n,).

    Raises:
        BadInput: a run was left before ``measure.limit_s``, so that its value is not known; or it has no score.

    """
    time_s = runs["time_s"].to_numpy(dtype=float)
    status = runs["status"].to_numpy(dtype=object)
    completed = status == "completed"
    if measure.kind == "score":
        score: FloatArray = runs["score"].to_numpy(dtype=float)
        _refuse_unknown(np.isnan(score), "runs: score", "no score", "Measure time or success.")
        return score
    early = (status == "censored") & (time_s < measure.limit_s) & np.isfinite(measure.limit_s)
    hint = f"Choose a limit of at most {time_s[status == 'censored'].min(initial=np.inf):g} s."
    _refuse_unknown(early, "measure", f"left before {measure.limit_s:g} s", hint)
    in_time: BoolArray = completed & (time_s <= measure.limit_s)
    if measure.kind == "success":
        return in_time.astype(np.float64)
    restricted: FloatArray = np.where(in_time, time_s, measure.limit_s)
    return restricted


def _refuse_unknown(unknown: BoolArray, where: str, what: str, hint: str) -> None:
    if unknown.any():
        raise refuse(where, f"{int(unknown.sum())} of {unknown.size} runs: {what}", hint)


def cells(runs: pd.DataFrame, factors: Sequence[str]) -> list[tuple[tuple[Any, ...], pd.DataFrame]]:
    """The runs of each cell, as ``(factor values, rows)``, in the order in which the cells first appear."""
    if not factors:
        return [((), runs)]
    return [(tuple(key), rows) for key, rows in runs.groupby(list(factors), sort=False, dropna=False)]
