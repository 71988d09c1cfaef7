"""Which factors matter: Morris screening and Sobol indices, by SALib.

SALib sees the unit cube only; :func:`teleop_sim.stats.designs.cells_at` makes cells of its places. So lists,
logarithms and whole numbers are this project's, and an effect is that of crossing a factor's whole range.

A generator is handed to SALib, never a number: its analysis takes a seed of 0 for none (SALib 1.6) and would differ
from process to process.

Not modelled: factors that depend on each other. Outputs should be means over replicates that share random numbers; the
noise that is left counts as interaction of all factors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from teleop_sim.core.streams import stream
from teleop_sim.stats.estimate import CONFIDENCE, refuse
from teleop_sim.stats.factors import Factor
from teleop_sim.stats.runs import FloatArray

if TYPE_CHECKING:
    import pandas as pd

MORRIS_LEVELS = 4
"""Places along each factor: 0, 1/3, 2/3, 1. Source: Morris, Technometrics 33 (1991), 161-174."""


def morris_design(factors: Sequence[Factor], trajectories: int, seed: int) -> FloatArray:
    """Trajectories that change one factor at a time, shape (trajectories * (k + 1), k), in the unit cube.

    Raises:
        BadInput: no trajectory or no factor.

    Source: Morris (1991). 10 to 50 trajectories are usual: Saltelli et al., Global Sensitivity Analysis (2008), ch. 3.

    """
    from SALib.sample.morris import sample

    _check(factors, trajectories)
    rng = stream(seed, 0, "stats.morris.design")
    return np.asarray(sample(_problem(factors), trajectories, num_levels=MORRIS_LEVELS, seed=rng), dtype=np.float64)


def morris_analyse(factors: Sequence[Factor], unit: FloatArray, outputs: ArrayLike, seed: int) -> pd.DataFrame:
    """Elementary effects of each factor.

    Args:
        factors: as given to :func:`morris_design`.
        unit: what it returned.
        outputs: the measure at each place, shape (places,).
        seed: of the bootstrap.

    Returns:
        A row a factor: factor; mu, the mean effect of crossing its range; mu_star, the mean of the absolute effect;
        mu_star_half, half width of its 95 % interval (bootstrap); sigma, the spread: curvature or interaction.

    Raises:
        BadInput: a number of outputs other than of places, or one that is not finite.

    Source of mu_star: Campolongo, Cariboni and Saltelli, Environ. Model. Softw. 22 (2007), 1509-1518.

    """
    import pandas as pd
    from SALib.analyze.morris import analyze

    y = _outputs(outputs, unit.shape[0])
    rng = stream(seed, 0, "stats.morris.analyse")
    found = analyze(_problem(factors), unit, y, num_levels=MORRIS_LEVELS, conf_level=CONFIDENCE, seed=rng)
    names = {"mu": "mu", "mu_star": "mu_star", "mu_star_half": "mu_star_conf", "sigma": "sigma"}
    columns = {ours: np.asarray(found[theirs], dtype=np.float64) for ours, theirs in names.items()}
    return pd.DataFrame({"factor": [f.name for f in factors]} | columns)


def sobol_design(factors: Sequence[Factor], base: int, seed: int) -> FloatArray:
    """Places for Sobol indices, shape (base * (k + 2), k), in the unit cube.

    Raises:
        BadInput: no factor, or a base that is no power of two (the sequence is balanced only then).

    Source: Saltelli et al., Comput. Phys. Commun. 181 (2010), 259-270.

    """
    from SALib.sample.sobol import sample

    _check(factors, base)
    if base & (base - 1):
        raise refuse("sensitivity", f"a base of {base}", f"Give a power of two, such as {1 << base.bit_length()}.")
    rng = stream(seed, 0, "stats.sobol.design")
    return np.asarray(sample(_problem(factors), base, calc_second_order=False, seed=rng), dtype=np.float64)


def sobol_analyse(factors: Sequence[Factor], outputs: ArrayLike, seed: int) -> pd.DataFrame:
    """Shares of the output's variance.

    Args:
        factors: as given to :func:`sobol_design`.
        outputs: the measure at each of its places, in their order.
        seed: of the bootstrap.

    Returns:
        A row a factor: factor; first, the share that it explains alone; first_half; total, the share that vanishes only
        if it is fixed, interactions included; total_half: half widths of 95 % intervals (bootstrap).

    Raises:
        BadInput: a number of outputs that fits no base, one that is not finite, or all alike: there is no variance.

    Sources: first: Saltelli et al. (2010); total: Jansen, Comput. Phys. Commun. 117 (1999), 35-43.

    """
    import pandas as pd
    from SALib.analyze.sobol import analyze

    y = np.asarray(outputs, dtype=np.float64)
    y = _outputs(y, max(y.size // (len(factors) + 2), 1) * (len(factors) + 2))
    if np.ptp(y) == 0.0:
        raise refuse("sensitivity", "all outputs are alike", "Widen the ranges or take another measure.")
    rng = stream(seed, 0, "stats.sobol.analyse")
    found = analyze(_problem(factors), y, calc_second_order=False, conf_level=CONFIDENCE, seed=rng)
    names = {"first": "S1", "first_half": "S1_conf", "total": "ST", "total_half": "ST_conf"}
    columns = {ours: np.asarray(found[theirs], dtype=np.float64) for ours, theirs in names.items()}
    return pd.DataFrame({"factor": [f.name for f in factors]} | columns)


def _problem(factors: Sequence[Factor]) -> dict[str, Any]:
    return {"num_vars": len(factors), "names": [f.name for f in factors], "bounds": [[0.0, 1.0]] * len(factors)}


def _check(factors: Sequence[Factor], count: int) -> None:
    if not factors or count < 1:
        raise refuse("sensitivity", f"{len(factors)} factors, {count} samples", "Give one or more of each.")


def _outputs(outputs: ArrayLike, places: int) -> FloatArray:
    y = np.asarray(outputs, dtype=np.float64)
    if y.shape != (places,) or not np.isfinite(y).all():
        hint = "Give one finite number for each place, in the order of the design."
        raise refuse("sensitivity", f"outputs of shape {y.shape} for {places} places, or not finite", hint)
    return y
