"""Missions at the crank, as ``benchmarks/crank_study.py`` runs them: a few here, all of them where there is time."""

from __future__ import annotations

import importlib.util
import itertools
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pinocchio as pin
import pytest

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import CircularAffordance
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skills.manipulate import arm_of, table_of
from teleop_sim.robot.templates import crank_stand
from teleop_sim.world import console
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant

FULL_SIZE = ("atlas", "valkyrie")
"""THORMANG3 has a test of its own: the console's wheels are at its limits (docs/physics.md)."""


@pytest.fixture(scope="module")
def study() -> Iterator[ModuleType]:
    """The benchmark, which no import finds."""
    path = Path(__file__).parents[2] / "benchmarks" / "crank_study.py"
    spec = importlib.util.spec_from_file_location("crank_study_under_test", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # A dataclass looks up its module by name.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.mark.parametrize(("robot", "seed"), [("atlas", 1), ("valkyrie", 2)])
def test_walk_crank_three_turns_and_draw_back(study: ModuleType, robot: str, seed: int) -> None:
    trial = study.crank(study.Setting(robot), seed)
    assert trial.done, trial.told
    assert trial.grips == study.TURNS
    # With the ZMP moved for the hand's push; 22 mm without. What is left is tugs, whose push nobody knows.
    assert trial.balance_m < 0.015


def strain(robot: str, wheel_nm: float) -> tuple[bool, float]:
    """Is the whole circle in reach from the stand, and the largest share of a wrist's torque, gravity included."""
    spec = ROBOTS[robot]()
    body = Body(spec, Plant(spec.model, BareFloor()))
    body.load(body.standing())
    arm, stand = arm_of(body, "right"), crank_stand(robot)
    zero, _, axis = console.wheel_axes()
    centre = (stand.ahead_m, -stand.aside_m, console.WHEEL_HEIGHT_M - console.WALKWAY_HEIGHT_M)
    wheel = CircularAffordance(centre, axis, zero, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, 0.0)
    table = table_of(arm, wheel)
    wrist = spec.arms["right"][-3:]
    effort = np.array([spec.model.description.joint(name).effort_nm for name in wrist])
    places, model, data = arm.kinematics.positions(wrist) - 1, arm.kinematics.model, arm.kinematics.data
    held = np.array([pin.computeGeneralizedGravity(model, data, q)[places] for q in table.q])
    pushed = wheel_nm / console.KNOB_ORBIT_M * table.push[:, places]
    return table.usable, float((np.maximum(abs(held + pushed), abs(held - pushed)) / effort).max())


def test_the_small_robots_wrist_holds_the_heaviest_wheel() -> None:
    """THORMANG3's wrist has 5.1 N m: a wheel of 3 N m takes 84 % of it, statically."""
    usable, share = strain("thormang3", 3.0)
    assert usable
    assert 0.75 < share < 0.9


def test_the_small_robot_cranks_a_light_wheel(study: ModuleType) -> None:
    trial = study.crank(study.Setting("thormang3", wheel_nm=(1.0, 1.0)), 4)
    assert trial.done, trial.told


@pytest.mark.slow
@pytest.mark.parametrize("robot", FULL_SIZE)
def test_missions_with_exact_perception(study: ModuleType, robot: str) -> None:
    trials = study.row(study.Setting(robot), range(1, 31), None)
    told = [f"{trial.seed}: {trial.told}" for trial in trials if not trial.done]
    assert len(told) <= 3, told


@pytest.mark.slow
@pytest.mark.parametrize("robot", FULL_SIZE)
def test_missions_fail_where_perception_does(study: ModuleType, robot: str) -> None:
    done = []
    for error_m in (0.0, 0.01, 0.02, 0.04):
        trials = study.row(study.Setting(robot, error_m=error_m), range(1, 11), None)
        done.append(sum(trial.done for trial in trials))
    # Falling but for two of ten, which is one sigma of a share of a half.
    assert all(after <= before + 2 for before, after in itertools.pairwise(done)), done
    assert done[0] >= 9
    assert done[-1] <= 7
