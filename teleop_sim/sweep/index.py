"""The index of a sweep: one row a run, as Parquet and as a DataFrame."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from teleop_sim.reports.figures import RUN_FIGURES
from teleop_sim.sweep.folder import Row, SweepBroken, SweepFolder, replace_with
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
    import pandas as pd

    folder = SweepFolder(Path(path))
    plan, _ = folder.read()
    if not folder.index.exists():
        return frame(plan, folder.rows(plan.replicates))
    try:
        return pd.read_parquet(folder.index)
    except (OSError, ValueError) as error:
        hint = "Remove it: it is written again by teleop-sim sweep --resume."
        raise SweepBroken(str(folder.index), f"does not read: {error}", hint) from None


def frame(plan: Plan, rows: Sequence[Row]) -> pd.DataFrame:
    """Rows as a DataFrame; what is not known is NaN."""
    import pandas as pd

    factors = [factor.name for factor in plan.factors]
    columns = ["cell", "replicate", *factors, *RUN_FIGURES, "limit_s", "log", "log_bytes", "log_digest"]
    values = {name: [_cell(row.get(name)) for row in rows] for name in columns}
    made = pd.DataFrame(values, columns=columns)
    return made.astype({name: _type(name) for name in columns if name not in factors})


def write_index(folder: SweepFolder, plan: Plan, rows: Sequence[Row]) -> None:
    """Write the index, whole or not at all."""
    buffer = io.BytesIO()
    frame(plan, rows).to_parquet(buffer, index=False)
    replace_with(folder.index, buffer.getvalue())


def _type(name: str) -> str:
    if name in _TEXTS:
        return "str"
    return "int64" if name in _WHOLE or name.endswith(_WHOLE_ENDS) else "float64"


def _cell(value: object) -> object:
    # A list of a scenario file is a factor's value like any other, and Parquet wants one type a column.
    return str(value) if isinstance(value, list | tuple) else value
