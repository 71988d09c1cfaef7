"""Postures for a hand that goes round a circle: one table, closed on itself, serves any number of turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin

from teleop_sim.robot.chain_ik import ChainIk, Solution, Stance, Target, search, two_stage
from teleop_sim.robot.commands import CircularAffordance, Side
from teleop_sim.robot.kinematics import Kinematics

POINTS = 48
ARM_POSITION_M, ARM_AXIS_RAD = 0.005, 0.1
"""Residuals with which the arm alone is good enough (assumed)."""
REFUSE_POSITION_M, REFUSE_AXIS_RAD = 0.012, 0.3
"""Residuals above which there is no plan: measured to be what the cage still holds."""

GIVE_UP: Final = {"arm": (0.025, 1), "chain": (0.06, 6)}
"""By stage: residual [m] beyond which the way round ends, five times what would be refused; new starts of a search
(assumed: where the arm alone is not enough, the chain is asked soon)."""

RESTARTS_SEED = 0
"""Starts of a search that failed are drawn, but always the same: a table is a function."""

SINK_M = 0.008
"""The tool goes this far below the handle's centre: the bars reach 2 cm beyond it, and a hand that is believed too low
still holds while one too high slips off (measured: the cause of most lost grips)."""


@dataclass(frozen=True)
class Circle:
    """An affordance's circle, ready for arithmetic.

    Attributes:
        hub: (3,) middle of the circle on which the tool goes [m].
        axis, zero, across: unit vectors; ``across`` is where handle angle 90 degrees lies.
        radius_m: of the circle.
        frame: (3, 3), its rows are zero, across, axis.

    """

    hub: np.ndarray
    axis: np.ndarray
    zero: np.ndarray
    across: np.ndarray
    radius_m: float
    frame: np.ndarray

    def place(self, angle_rad: float, lift_m: float = 0.0) -> Target:
        """Where the tool goes for a handle angle, lifted off along the axis from where it holds the handle."""
        spoke = math.cos(angle_rad) * self.zero + math.sin(angle_rad) * self.across
        return Target(self.hub + lift_m * self.axis + self.radius_m * spoke, -self.axis)

    def direction(self, angle_rad: float) -> np.ndarray:
        """Unit vector (3,) along the handle's path, anticlockwise about the axis."""
        return math.cos(angle_rad) * self.across - math.sin(angle_rad) * self.zero

    def polar(self, position: np.ndarray) -> tuple[float, float]:
        """Handle angle of a point (3,), in (-pi, pi], and its distance from the circle [m]."""
        along, over, up = (self.frame @ (position - self.hub)).tolist()
        return math.atan2(over, along), math.hypot(math.hypot(along, over) - self.radius_m, up)

    def angle_of(self, position: np.ndarray) -> float:
        """Handle angle of the place on the circle nearest a point (3,), in (-pi, pi]."""
        return self.polar(position)[0]


def circle_of(affordance: CircularAffordance) -> Circle:
    """Make an affordance's circle."""
    axis, zero = np.array(affordance.axis), np.array(affordance.zero)
    hub = np.array(affordance.centre) + (affordance.height_m - SINK_M) * axis
    across = np.cross(axis, zero)
    return Circle(hub, axis, zero, across, affordance.radius_m, np.array([zero, across, axis]))


@dataclass(frozen=True)
class CircleTable:
    """Postures round a circle; row k is handle angle ``2 pi k / n`` and the last row is followed by the first.

    Attributes:
        q: (n, nq) whole configurations.
        push: (n, nv) joint torques [N m] with which the hand pushes 1 N along the path, anticlockwise.
        position_error_m, axis_error_rad: the worst residuals round the circle.
        limit_margin_rad: the least distance from a joint limit.
        seam_rad: the largest joint step between neighbouring rows, last to first included.
        stage: ``arm`` or ``chain``.

    """

    q: np.ndarray
    push: np.ndarray
    position_error_m: float
    axis_error_rad: float
    limit_margin_rad: float
    seam_rad: float
    stage: str

    @property
    def usable(self) -> bool:
        """Whether the hand can go all the way round."""
        return self.position_error_m <= REFUSE_POSITION_M and self.axis_error_rad <= REFUSE_AXIS_RAD

    def at(self, angle_rad: float) -> np.ndarray:
        """Configuration (nq,) at a handle angle of any number of turns, between rows in proportion."""
        place = angle_rad / (2 * np.pi) * len(self.q)
        row = math.floor(place)
        here, there = self.q[row % len(self.q)], self.q[(row + 1) % len(self.q)]
        return np.asarray(here + (place - row) * (there - here))


def circle_table(
    kinematics: Kinematics,
    side: Side,
    stance: Stance,
    rest: np.ndarray,
    affordance: CircularAffordance,
    points: int = POINTS,
) -> CircleTable:
    """Plan in two stages: the 7-joint arm alone, then, if that leaves too much, torso and arm.

    A function of its arguments, but not of the affordance's angle: the search goes from ``rest`` to the handle's place
    nearest the robot, and from there round. See ``CircleTable.usable``.
    """
    tables: list[CircleTable] = []
    circle, rng = circle_of(affordance), np.random.default_rng(RESTARTS_SEED)
    middle = (stance.feet[0].translation + stance.feet[1].translation) / 2
    first = round(circle.angle_of(middle) / (2 * np.pi) * points) % points
    for stage, solver in two_stage(kinematics, side, stance, rest):
        start = tables[-1].q[first] if tables else rest
        table = _go_round(solver, stage, start, circle, first, rng, points)
        if table.position_error_m <= ARM_POSITION_M and table.axis_error_rad <= ARM_AXIS_RAD:
            return table
        tables.append(table)
    return min(tables, key=lambda t: t.position_error_m + 0.1 * t.axis_error_rad)


def _go_round(
    solver: ChainIk,
    stage: str,
    start: np.ndarray,
    circle: Circle,
    first: int,
    rng: np.random.Generator,
    points: int,
) -> CircleTable:
    """Solve from row to row until the next row is the one found a lap before, or a row cannot be reached at all."""
    targets = [circle.place(2 * np.pi * k / points) for k in range(points)]
    give_up_m, restarts = GIVE_UP[stage]
    found: dict[int, Solution] = {first: search(solver, start, targets[first], rng, restarts)}
    q = found[first].q
    for lap_step in range(1, 2 * points + 1):
        k = (first + lap_step) % points
        solution = solver.solve(q, targets[k], 12)
        known = found.get(k)
        found[k], q = solution, solution.q
        if solution.position_error_m > give_up_m:
            break
        if known is not None and np.abs(known.q - solution.q).max() < 2e-3:
            break
    return _as_table(solver, stage, [found.get(k, found[first]) for k in range(points)], targets, circle)


def _as_table(solver: ChainIk, stage: str, rows: list[Solution], targets: list[Target], circle: Circle) -> CircleTable:
    # Judged again: a row that was never reached holds another row's posture.
    rows = [solver.judge(row.q, target) for row, target in zip(rows, targets, strict=True)]
    q = np.array([row.q for row in rows])
    angles = 2 * np.pi * np.arange(len(rows)) / len(rows)
    push = [_push(solver.kinematics, solver.side, row, circle.direction(a)) for row, a in zip(q, angles, strict=True)]
    seam = np.abs(np.roll(q, -1, axis=0)[:, 7:] - q[:, 7:]).max()
    return CircleTable(
        q=q,
        push=np.array(push),
        position_error_m=max(row.position_error_m for row in rows),
        axis_error_rad=max(row.axis_error_rad for row in rows),
        limit_margin_rad=min(row.limit_margin_rad for row in rows),
        seam_rad=float(seam),
        stage=stage,
    )


def _push(kinematics: Kinematics, side: Side, q: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Joint torques (nv,) of one newton at the tool: the Jacobian's transpose."""
    pin.computeJointJacobians(kinematics.model, kinematics.data, q)
    pin.updateFramePlacements(kinematics.model, kinematics.data)
    tool = kinematics.tools[side]
    jacobian = pin.getFrameJacobian(kinematics.model, kinematics.data, tool, pin.LOCAL_WORLD_ALIGNED)
    return np.asarray(jacobian[:3].T @ direction)
