"""Compiled code must find by address what Python finds by name."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from teleop_sim.robot import law
from teleop_sim.robot.body import Body
from teleop_sim.robot.law_wires import unwire, wire
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.belief import Load
from teleop_sim.world.plant import Plant


@njit
def found(table):
    return unwire(table)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("loaded", [False, True])
def test_what_is_wired_is_what_was_given(name: str, loaded: bool) -> None:
    spec = ROBOTS[name]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    body.load(body.standing())
    if loaded:
        body.carry((Load(spec.model.description.links[-1].name, 1.0, (0.0, 0.0, 0.0)),))
    gains, memory, arrays = found(body._wires.table)
    assert gains == law.Gains(*body._figures)
    assert np.array_equal(memory, body._memory)
    for field in law.Arrays._fields:
        given, seen = getattr(body._arrays, field), getattr(arrays, field)
        assert seen.shape == given.shape, field
        assert np.array_equal(seen, given), field


def test_what_has_gaps_or_another_type_is_refused() -> None:
    spec = ROBOTS["valkyrie"]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    for bad in (np.zeros((4, 2))[:, 0], np.zeros(4, np.float32)):
        with pytest.raises(ValueError, match="the law reads float64 and int64 without gaps"):
            wire(body._figures, body._memory, body._arrays._replace(com=bad))
