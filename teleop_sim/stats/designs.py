"""Designs: which cells an experiment visits."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from teleop_sim.stats.estimate import refuse
from teleop_sim.stats.factors import Factor, Value, at, grid_levels
from teleop_sim.stats.runs import FloatArray

Cell = dict[str, Value]
"""A value for each factor, by name."""


def full_grid(factors: Sequence[Factor]) -> list[Cell]:
    """Every combination, the last factor varying fastest.

    Raises:
        BadInput: no factor, two of one name, or a range without a number of points.

    """
    names = _names(factors)
    return [dict(zip(names, values, strict=True)) for values in product(*map(grid_levels, factors))]


def latin_hypercube(factors: Sequence[Factor], cells: int, rng: np.random.Generator) -> list[Cell]:
    """Cells of which each of ``cells`` equal parts of every range holds exactly one.

    Raises:
        BadInput: no factor, two of one name, or no cell.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979), 239-245; drawn by scipy.stats.qmc.

    """
    from scipy.stats import qmc

    _names(factors)
    if cells < 1:
        raise refuse("design", f"{cells} cells", "Give one or more.")
    return cells_at(factors, qmc.LatinHypercube(len(factors), rng=rng).random(cells))


def sobol_cells(factors: Sequence[Factor], cells: int, rng: np.random.Generator) -> list[Cell]:
    """Cells of a scrambled Sobol sequence.

    Raises:
        BadInput: no factor, two of one name, or a number of cells that is no power of two: only then is it balanced.

    Sources: Sobol, USSR Comput. Math. 7 (1967), 86-112; Owen, J. Complexity 14 (1998), 466-489; by scipy.stats.qmc.

    """
    from scipy.stats import qmc

    _names(factors)
    if cells < 1 or cells & (cells - 1):
        near = 1 << max(cells, 1).bit_length()
        raise refuse("design", f"{cells} cells are no power of two", f"Give {max(near // 2, 1)} or {near}.")
    return cells_at(factors, qmc.Sobol(len(factors), rng=rng).random_base2(cells.bit_length() - 1))


def cells_at(factors: Sequence[Factor], unit: FloatArray) -> list[Cell]:
    """Cells from places in the unit cube, shape (cells, factors)."""
    return [{f.name: at(f.levels, float(u)) for f, u in zip(factors, row, strict=True)} for row in unit]


def _names(factors: Sequence[Factor]) -> list[str]:
    names = [f.name for f in factors]
    if not names or len(set(names)) < len(names):
        raise refuse("design", f"factors {', '.join(names) or 'none'}", "Give one or more, each once.")
    return names
