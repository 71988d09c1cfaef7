"""The index of a sweep: one row a run, as Parquet and as a DataFrame."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from teleop_sim.reports.drc_times import COLUMNS as TIME_COLUMNS
from teleop_sim.reports.figures import RUN_FIGURES
from teleop_sim.reports.state_counts import COLUMNS
from teleop_sim.sweep.folder import STATES, TIMES, Row, SweepBroken, SweepFolder, replace_with
from teleop_sim.sweep.plan import Plan

if TYPE_CHECKING:
    import pandas as pd

_TEXTS: Final = ("outcome", "status", "cause", "log", "log_digest")
_WHOLE: Final = ("cell", "replicate", "score", "round_trips", "requests", "retries", "episodes", "operator_acts")
_WHOLE_ENDS: Final = ("_packets", "_delivered", "_dropped", "_bits", "_bytes")


def load_sweep(path: Path | str) -> pd.DataFrame:
    """The finished runs of a sweep, by cell and replicate; of one that was killed, those that were finished.

    Columns: ``cell``, ``replicate``, one for each factor, those of ``reports.figures.RUN_FIGURES``, ``limit_s``,
    ``log`` (from the directory; empty if none was kept), ``log_bytes`` and ``log_digest`` (BLAKE2b, 16 bytes). They
    are what ``teleop_sim.stats`` asks for.

    Args:
        path: of the sweep's directory.

    Raises:
        SweepBroken: it is no sweep.

    """
    folder = SweepFolder(Path(path))
    plan, _ = folder.read()
    return _read(folder.index) if folder.index.exists() else frame(plan, folder.rows(plan.replicates))


def load_sweep_states(path: Path | str) -> pd.DataFrame | None:
    """The states of a sweep's finished runs: a row a run and state, by cell, replicate and first visit.

    Columns: ``cell`` and ``replicate``, as in ``load_sweep``, and the fields of ``reports.state_counts.StateCount``.

    Args:
        path: of the sweep's directory.

    Returns:
        None where a sweep of an earlier version has kept none.

    Raises:
        SweepBroken: it is no sweep.

    """
    folder = SweepFolder(Path(path))
    plan, _ = folder.read()
    if not (folder.index.exists() and folder.states.exists()):
        return state_frame(folder.rows(plan.replicates))
    return _read(folder.states)


def load_sweep_times(path: Path | str) -> pd.DataFrame | None:
    """Of a sweep at door or valve the columns of the ViGIR paper's Table 2 [s], a row a finished run.

    Columns: ``cell``, ``replicate`` and the fields of ``reports.drc_times.Times``. See ``load_sweep_states``.
    """
    folder = SweepFolder(Path(path))
    plan, _ = folder.read()
    if not (folder.index.exists() and folder.times.exists()):
        return None if folder.index.exists() and folder.states.exists() else time_frame(folder.rows(plan.replicates))
    return _read(folder.times)


def _read(path: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        return pd.read_parquet(path)
    except (OSError, ValueError) as error:
        hint = "Remove it: it is written again by teleop-sim sweep --resume."
        raise SweepBroken(str(path), f"does not read: {error}", hint) from None


def state_frame(rows: Sequence[Row]) -> pd.DataFrame | None:
    """The states of all runs; None where no row has any."""
    import pandas as pd

    if rows and not any(STATES in row for row in rows):
        return None
    lines = [(row["cell"], row["replicate"], *state) for row in rows for state in row.get(STATES, ())]
    made = pd.DataFrame(lines, columns=["cell", "replicate", *COLUMNS])
    whole = dict.fromkeys(
        ("cell", "replicate", "visits", "normal", "auto", "manual", "retries", "interrupted"), "int64"
    )
    return made.astype(whole | {"state": "category", "during": "category", "time_s": "float64"})


def time_frame(rows: Sequence[Row]) -> pd.DataFrame | None:
    """The columns of Table 2 of all runs; None where no row has any."""
    import pandas as pd

    lines = [(row["cell"], row["replicate"], *row[TIMES]) for row in rows if TIMES in row]
    if not lines:
        return None
    made = pd.DataFrame(lines, columns=["cell", "replicate", *TIME_COLUMNS])
    return made.astype(dict.fromkeys(TIME_COLUMNS, "float64"))


def frame(plan: Plan, rows: Sequence[Row]) -> pd.DataFrame:
    """Rows as a DataFrame; what is not known is NaN."""
    import pandas as pd

    factors = [factor.name for factor in plan.factors]
    columns = ["cell", "replicate", *factors, *RUN_FIGURES, "limit_s", "log", "log_bytes", "log_digest"]
    values = {name: [_cell(row.get(name)) for row in rows] for name in columns}
    made = pd.DataFrame(values, columns=columns)
    return made.astype({name: _type(name) for name in columns if name not in factors})


def write_index(folder: SweepFolder, plan: Plan, rows: Sequence[Row]) -> None:
    """Write the index and the tables of states and times, each whole or not at all; the index last."""
    for path, table in ((folder.states, state_frame(rows)), (folder.times, time_frame(rows))):
        if table is None:
            path.unlink(missing_ok=True)
        else:
            _write(path, table)
    _write(folder.index, frame(plan, rows))


def _write(path: Path, table: pd.DataFrame) -> None:
    buffer = io.BytesIO()
    table.to_parquet(buffer, index=False)
    replace_with(path, buffer.getvalue())


def _type(name: str) -> str:
    if name in _TEXTS:
        return "str"
    return "int64" if name in _WHOLE or name.endswith(_WHOLE_ENDS) else "float64"


def _cell(value: object) -> object:
    # A list of a scenario file is a factor's value like any other, and Parquet wants one type a column.
    return str(value) if isinstance(value, list | tuple) else value
