"""Which factors of a sweep matter: elementary effects (Morris) or Sobol indices, over means of replicates."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.stats.runs import Measure, common_limit_s, measured
from teleop_sim.stats.sensitivity import morris_analyse, morris_design, sobol_analyse
from teleop_sim.sweep.designs import SENSITIVITY
from teleop_sim.sweep.folder import SweepFolder
from teleop_sim.sweep.index import load_sweep

if TYPE_CHECKING:
    import pandas as pd


def sensitivity(directory: Path | str, kind: str = "time", limit_s: float | None = None) -> pd.DataFrame:
    """A row a factor: how much the measure's mean depends on it.

    Args:
        directory: of a sweep with ``--design morris:N`` or ``saltelli:N``, finished.
        kind: of the measure: ``time``, ``success`` or ``score``.
        limit_s: restriction or deadline; None: the shortest time limit.

    Returns:
        See ``stats.sensitivity.morris_analyse`` and ``sobol_analyse``.

    Raises:
        BadInput: another design, or runs are missing. SweepBroken: no sweep.

    """
    plan, _ = SweepFolder(Path(directory)).read()
    design, colon, count = plan.design.partition(":")
    if design not in SENSITIVITY or not colon:
        what = f"the design is {plan.design}"
        raise BadInput((Problem(str(directory), what, "Sweep with --design morris:N or saltelli:N."),))
    runs = load_sweep(directory)
    if len(runs) < plan.runs:
        what = f"{len(runs)} of {plan.runs} runs are finished"
        raise BadInput((Problem(str(directory), what, "Go on with teleop-sim sweep --resume, without --until."),))
    measure = Measure(kind, common_limit_s(runs) if limit_s is None else limit_s)
    means = runs.assign(_value=measured(runs, measure)).groupby("cell")["_value"].mean()
    factors = [factor.designed() for factor in plan.factors]
    if design == "morris":
        return morris_analyse(factors, morris_design(factors, int(count), plan.seed), means.to_numpy(), plan.seed)
    return sobol_analyse(factors, means.to_numpy(), plan.seed)
