"""Paths of torso and arm by optimisation: slower than ``teleop_sim.robot.ways``, asked where that finds none.

Ten joints at ``POINTS`` instants between two postures. Least squares of joint accelerations, the torso's weighted by
its mass, subject to joint limits, joint speeds, gravity's torques at rest, the ZMP of the whole body between the soles,
and clearances (``teleop_sim.robot.arm_chain``). Solved by IPOPT through CasADi; it is deterministic. Whoever asks
checks the path found with ``teleop_sim.robot.collision``.

Not modelled: torques of acceleration (moves are slow), what arm joints do to the pelvis' height.

Sources: Waechter and Biegler, Mathematical Programming 106 (2006), 25-57: IPOPT. ZMP: Kajita, Hirukawa, Harada, Yokoi,
Introduction to Humanoid Robotics (2014), the cart-table form.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from teleop_sim.robot.arm_chain import Chain, casadi, on_soles, outputs
from teleop_sim.robot.commands import Side
from teleop_sim.robot.crank_scene import Thing
from teleop_sim.robot.kinematics import Kinematics
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.plant import GRAVITY_M_S2

POINTS = 9
MOVE_S = 4.0
"""Instants between start and goal, 0.4 s apart (assumed)."""
RATE_RAD_S = 0.9
"""Of the fastest joint: Valkyrie's wrists are limited to 1 rad/s."""
TORQUE_SHARE = 0.9
SOLE_SHARE = 0.6
"""Of a sole's half length, and of half the way between the feet, in which the ZMP stays (assumed)."""
LIMIT_RAD = 0.03
ITERATIONS = 150


@dataclass(frozen=True)
class ArmPath:
    """Configurations (n, nq), the last is the goal; IPOPT's iterations and its own word on how it ended."""

    q: np.ndarray
    iterations: int
    status: str

    @property
    def solved(self) -> bool:
        """Whether all constraints hold."""
        return self.status in ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass
class _Bounded:
    """Expressions and their bounds."""

    what: list[Any] = field(default_factory=list)
    low: list[np.ndarray] = field(default_factory=list)
    high: list[np.ndarray] = field(default_factory=list)

    def add(self, what: Any, low: Any, high: Any) -> None:
        self.what.append(what)
        self.low.append(np.broadcast_to(np.asarray(low, dtype=float), (what.shape[0],)))
        self.high.append(np.broadcast_to(np.asarray(high, dtype=float), (what.shape[0],)))


def optimise(
    kinematics: Kinematics,
    spec: RobotSpec,
    side: Side,
    start: np.ndarray,
    goal: np.ndarray,
    via: np.ndarray,
    things: tuple[Thing, ...],
) -> ArmPath:
    """Find a path from start to goal for torso and one arm; the search begins on a curve past ``via``.

    Args:
        kinematics, spec: of the robot. side: whose arm. start, goal, via: configurations (nq,). things: to keep off.

    """
    ca, chain = casadi(), Chain(kinematics, spec, side, start)
    first, last = start[chain.chain], goal[chain.chain]
    x = ca.SX.sym("x", len(first), POINTS)
    columns = [ca.DM(first), *(x[:, k] for k in range(POINTS)), ca.DM(last)]
    # The pelvis gives way to the trunk, so that the centre of mass stays: evenly from where it was to where it will be.
    pelvis = [start[:3] + k / (POINTS + 1) * (goal[:3] - start[:3]) for k in range(POINTS + 2)]
    joints, base = ca.SX.sym("q", len(first)), ca.SX.sym("base", 3)
    one = ca.Function("one", [joints, base], list(outputs(chain, joints, base, things)))
    weight = ca.DM([kinematics.torso_per_arm if name in kinematics.torso else 1.0 for name in chain.names])
    bends = [columns[k + 1] - 2 * columns[k] + columns[k - 1] for k in range(1, POINTS + 1)]
    nlp = {"x": ca.vec(x), "f": sum(ca.dot(weight * bend, bend) for bend in bends)}
    bounded = _constraints(chain, one, columns, pelvis)
    return _solve(chain, nlp, bounded, (first, via[chain.chain], last), goal)


def _constraints(chain: Chain, one: Any, columns: list[Any], pelvis: list[np.ndarray]) -> _Bounded:
    """At each instant torques, ZMP and clearances; between two, speeds, and clearances half way."""
    ca, bounded, dt_s = casadi(), _Bounded(), MOVE_S / (POINTS + 1)
    outs = [one(column, at) for column, at in zip(columns, pelvis, strict=True)]
    for k in range(1, POINTS + 1):
        com, torque, clear = outs[k]
        bounded.add(torque / ca.DM(chain.effort), -TORQUE_SHARE, TORQUE_SHARE)
        bounded.add(clear, 1.0, np.inf)
        pushed = (outs[k + 1][0] - 2 * com + outs[k - 1][0]) / dt_s**2
        along, across, far_m = on_soles(chain, com - float(chain.com[2]) / GRAVITY_M_S2 * pushed)
        least = np.array([SOLE_SHARE * chain.sole_half_m, SOLE_SHARE * far_m])
        bounded.add(ca.vertcat(along, across), -least, least)
    for k in range(POINTS + 1):
        bounded.add(columns[k + 1] - columns[k], -RATE_RAD_S * dt_s, RATE_RAD_S * dt_s)
        bounded.add(one((columns[k] + columns[k + 1]) / 2, (pelvis[k] + pelvis[k + 1]) / 2)[2], 1.0, np.inf)
    return bounded


def _solve(
    chain: Chain,
    nlp: dict[str, Any],
    bounded: _Bounded,
    ends: tuple[np.ndarray, np.ndarray, np.ndarray],
    goal: np.ndarray,
) -> ArmPath:
    ca, (first, past, last) = casadi(), ends
    ipopt = {"print_level": 0, "sb": "yes", "max_iter": ITERATIONS, "tol": 1e-4, "constr_viol_tol": 1e-4}
    nlp["g"] = ca.vertcat(*bounded.what)
    solver = ca.nlpsol("path", "ipopt", nlp, {"print_time": False, "ipopt": ipopt})
    lower = chain.kinematics.lower[chain.chain - 7] + LIMIT_RAD
    upper = chain.kinematics.upper[chain.chain - 7] - LIMIT_RAD
    shares = np.linspace(0.0, 1.0, POINTS + 2)[1:-1, None]
    guess = (1 - shares) * first + shares * last + 4 * shares * (1 - shares) * (past - (first + last) / 2)
    found = solver(
        x0=np.clip(guess, lower, upper).ravel(),
        lbx=np.tile(lower, POINTS),
        ubx=np.tile(upper, POINTS),
        lbg=np.concatenate(bounded.low),
        ubg=np.concatenate(bounded.high),
    )
    path = np.tile(chain.start, (POINTS + 1, 1))
    path[:-1, chain.chain] = np.array(found["x"]).reshape(POINTS, len(first))
    path[:-1, :3] += shares * (goal[:3] - chain.start[:3])
    path[-1] = goal
    stats = solver.stats()
    return ArmPath(path, int(stats["iter_count"]), str(stats["return_status"]))
