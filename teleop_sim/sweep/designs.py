"""The cells of a sweep from its factors, by the designs of ``teleop_sim.stats``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.streams import stream
from teleop_sim.stats.designs import Cell, cells_at, full_grid, latin_hypercube, sobol_cells
from teleop_sim.stats.factors import Factor as Levels
from teleop_sim.stats.factors import grid_levels
from teleop_sim.stats.runs import FloatArray
from teleop_sim.stats.sensitivity import morris_design, sobol_design
from teleop_sim.sweep.factors import Factor, Value

Cells = tuple[tuple[Value, ...], ...]
Places = Callable[[Sequence[Levels], int, int], FloatArray]
"""Places in the unit cube from factors, a count and a seed."""

MOST_CELLS: Final = 1_000_000
"""Of one sweep: more is a slip of the finger (assumed)."""


def _filled(
    draw: Callable[[Sequence[Levels], int, np.random.Generator], list[Cell]], name: str
) -> Callable[..., list[Cell]]:
    return lambda factors, count, seed: draw(factors, count, stream(seed, 0, f"sweep.design.{name}"))


def _placed(places: Places) -> Callable[..., list[Cell]]:
    return lambda factors, count, seed: cells_at(factors, places(factors, count, seed))


SENSITIVITY: Final[Mapping[str, Places]] = {"morris": morris_design, "saltelli": sobol_design}
"""Designs that an analysis of sensitivity asks for; they may visit a cell twice."""

SAMPLED: Final[Mapping[str, Callable[..., list[Cell]]]] = {
    "lhs": _filled(latin_hypercube, "lhs"),
    "sobol": _filled(sobol_cells, "sobol"),
    **{name: _placed(places) for name, places in SENSITIVITY.items()},
}
"""Name of a sampled design to what makes its cells from factors, a count and a seed."""


def grid(factors: Sequence[Factor]) -> Cells:
    """All combinations, the last factor fastest. Without factors one cell.

    Raises:
        BadInput: two factors of one name, a range without a number of points, or more cells than anybody could run.

    """
    if not factors:
        return ((),)
    levels = [f.designed() for f in factors]
    count = math.prod(len(grid_levels(f)) for f in levels)
    if count > MOST_CELLS:
        raise BadInput((Problem("sweep", f"the grid has {count:,} cells", "Give fewer values, or another --design."),))
    return _in_order(factors, full_grid(levels))


def sampled(factors: Sequence[Factor], kind: str, count: int, seed: int) -> Cells:
    """Cells of a sampled design; lists are sampled in equal parts.

    Args:
        factors: at least one.
        kind: of ``SAMPLED``.
        count: cells of ``lhs`` and ``sobol``, trajectories of ``morris``, base samples of ``saltelli``.
        seed: fixes the design.

    Raises:
        BadInput: what the design refuses.

    """
    return _in_order(factors, SAMPLED[kind]([f.designed() for f in factors], count, seed))


def _in_order(factors: Sequence[Factor], cells: Sequence[Cell]) -> Cells:
    return tuple(tuple(cell[f.name] for f in factors) for cell in cells)
