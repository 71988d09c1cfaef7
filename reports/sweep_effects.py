"""Which factors of a sweep matter: elementary effects (Morris) or Sobol indices, where the design was made for them."""

from __future__ import annotations

from typing import Final

from teleop_sim.core.units import format_time
from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.sweep_cells import records
from teleop_sim.reports.sweep_view import SweepRuns, bare

MORRIS: Final = (
    Column("mu", "mean effect [s]", 1, help="of crossing the factor's range"),
    Column("mu_star", "mean absolute effect [s]", 1, help="mean of its absolute value (Campolongo et al. 2007)"),
    Column("mu_star_half", "±", 1, help="half width of its 95 % interval"),
    Column("sigma", "spread [s]", 1, help="of the effects: curvature or interaction"),
)
SOBOL: Final = (
    Column("first", "first", 2, help="share of the variance that it explains alone (Saltelli et al. 2010)"),
    Column("first_half", "±", 2, help="half width of its 95 % interval"),
    Column("total", "total", 2, help="share that vanishes only if it is fixed, interactions included"),
    Column("total_half", "±", 2, help="half width of its 95 % interval"),
)


def effects(sweep: SweepRuns) -> Sheet | None:
    """A row a factor, the one that matters most first; None for other designs, and where nothing varied."""
    found = sweep.effects
    if found is None or not len(found):
        return None
    columns = MORRIS if "mu_star" in found.columns else SOBOL
    found = found.sort_values("mu_star" if columns is MORRIS else "total", ascending=False, kind="stable")
    rows: list[tuple[Cell, ...]] = [
        (bare(str(row["factor"])), *(float(row[column.name]) for column in columns)) for row in records(found)
    ]
    kind = "Elementary effects" if columns is MORRIS else "Sobol indices"
    limit = format_time(sweep.limit_s)
    note = f"{kind} on the mean completion time of a cell, where a run not completed by {limit}, or failed, counts it."
    return Sheet((Column("factor", "factor"), *columns), tuple(rows), note=note)
