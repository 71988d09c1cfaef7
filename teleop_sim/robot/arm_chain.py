"""One arm and the torso as expressions: where they are, what they weigh and how near to things they come.

Forward kinematics of ten joints from the pelvis out in CasADi's symbols, because Pinocchio's own are not in its wheel.
What hangs on the chain without being of it (head, other arm) is fixed to it as in the posture given.

Clearances are of balls along arm and hand to smooth bodies round the things: a norm of order ``ORDER`` in place of a
box's corners (Barr, IEEE Computer Graphics and Applications 1 (1981), 11-23: superellipsoids).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from teleop_sim.robot.commands import Side
from teleop_sim.robot.crank_scene import HANDLE, Thing
from teleop_sim.robot.kinematics import Kinematics
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.plant import GRAVITY_M_S2

ORDER = 6
MARGIN_M = 0.015
"""Clearance asked of the balls, more than of the way found: bodies between balls are not seen (assumed)."""
LEGS_FOLLOW = 0.6
"""Share of the pelvis' way that the middle of pelvis and legs goes (assumed: legs turn about the ankles)."""
HAND_BALLS = ((0.0, 0.075), (-0.06, 0.07), (0.02, 0.07))
"""Along the tool's z [m] and radius [m]: they wrap the open cage and its flange (``teleop_sim.world.cage``)."""


def casadi() -> Any:
    """The library, imported when it is first asked for: a run seldom is, and it takes a third of a second."""
    return import_module("casadi")


@dataclass(frozen=True)
class _Body:
    """What one joint of the chain carries: placement before it (R, p), axis, mass [kg] and its middle (3,) [m]."""

    rotation: np.ndarray
    position: np.ndarray
    axis: np.ndarray
    mass_kg: float
    com: np.ndarray
    balls: tuple[tuple[np.ndarray, float], ...]


class Chain:
    """Torso and one arm from a posture ``start`` (nq,).

    Attributes:
        names, chain: of its joints, and their places in ``q``.
        effort: their torque limits [N m].
        com: (3,) centre of mass at the start [m]. soles: placements of the soles. sole_half_m: half a sole's length.

    """

    def __init__(self, kinematics: Kinematics, spec: RobotSpec, side: Side, start: np.ndarray) -> None:
        self.kinematics, self.side, self.start = kinematics, side, start
        self.names = (*kinematics.torso, *kinematics.arms[side])
        self.chain = kinematics.positions(self.names)
        model, data = kinematics.model, kinematics.data
        pin.forwardKinematics(model, data, start)
        self.com = np.array(pin.centerOfMass(model, data, start))
        self.soles = [pin.updateFramePlacement(model, data, sole).copy() for sole in kinematics.soles]
        self.sole_half_m = spec.model.description.sole.size_m[0] / 2
        numbers = [model.getJointId(name) for name in self.names]
        axes = [np.array(spec.model.description.joint(name).axis, dtype=float) for name in self.names]
        subtrees = [set(model.subtrees[number]) for number in numbers] + [set()]
        self.bodies: list[_Body] = []
        other: Side = "right" if side == "left" else "left"
        self.others = self._still(spec, numbers[len(kinematics.torso) - 1], other)
        for i, number in enumerate(numbers):
            parent = numbers[i - 1] if i else model.getJointId("root")
            before = data.oMi[parent].actInv(data.oMi[model.parents[number]] * model.jointPlacements[number])
            mass_kg, com = _lump(model, data, number, sorted(subtrees[i] - subtrees[i + 1]))
            balls = self._balls(number, i == len(numbers) - 1)
            self.bodies.append(_Body(before.rotation, before.translation, axes[i], mass_kg, com, balls))
        self.effort = np.array([spec.model.description.joint(name).effort_nm for name in self.names])

    def _still(self, spec: RobotSpec, torso: int, other: Side) -> tuple[tuple[np.ndarray, float], ...]:
        """Balls of the other arm, which only the torso moves, in the frame of the last torso joint."""
        data, kinematics = self.kinematics.data, self.kinematics
        balls = [(limb.joint, p, limb.radius_m) for limb in kinematics.limbs[other] for p in limb.points]
        tool, palm = kinematics.tools[other], kinematics.model.getJointId(spec.arms[other][-1])
        place = kinematics.model.frames[tool].placement
        balls += [(palm, place.act(np.array([0.0, 0.0, z])), radius) for z, radius in HAND_BALLS]
        return tuple((data.oMi[torso].actInv(data.oMi[k]).act(p), radius) for k, p, radius in balls)

    def _balls(self, number: int, last: bool) -> tuple[tuple[np.ndarray, float], ...]:
        kinematics = self.kinematics
        balls = [
            (p, limb.radius_m) for limb in kinematics.limbs[self.side] if limb.joint == number for p in limb.points
        ]
        if last:
            tool = kinematics.model.frames[kinematics.tools[self.side]].placement
            balls += [(tool.act(np.array([0.0, 0.0, z])), radius) for z, radius in HAND_BALLS]
        return tuple(balls)


def _lump(model: Any, data: Any, number: int, joints: Sequence[int]) -> tuple[float, np.ndarray]:
    """Mass and middle, in the frame of joint ``number``, of what these joints carry."""
    masses = [float(model.inertias[k].mass) for k in joints]
    middles = [data.oMi[number].actInv(data.oMi[k]).act(model.inertias[k].lever) for k in joints]
    total = sum(masses)
    return total, np.sum([m * c for m, c in zip(masses, middles, strict=True)], axis=0) / total


def outputs(problem: Chain, q: Any, base: Any, things: tuple[Thing, ...]) -> tuple[Any, Any, Any]:
    """Whole centre of mass (3,), gravity's torques (n,), norms that must be at least 1, as expressions of the chain."""
    ca = casadi()
    rotation, position = ca.DM(pin.Quaternion(problem.start[3:7]).toRotationMatrix()), base
    moved, energy, balls = ca.SX.zeros(3), ca.SX(0), []
    trunk, still = (rotation, position), []
    for i, body in enumerate(problem.bodies):
        position = position + rotation @ ca.DM(body.position)
        rotation = rotation @ ca.DM(body.rotation) @ _turn(body.axis, q[i])
        at = position + rotation @ ca.DM(body.com)
        moved += body.mass_kg * at
        energy += body.mass_kg * GRAVITY_M_S2 * at[2]
        balls += [(position + rotation @ ca.DM(p), r) for p, r in body.balls]
        if i == len(problem.kinematics.torso) - 1:
            trunk = (rotation, position)
            still = [(position + rotation @ ca.DM(p), r) for p, r in problem.others]
    upper_kg = sum(body.mass_kg for body in problem.bodies)
    below = LEGS_FOLLOW * (problem.kinematics.mass_kg - upper_kg) * (base - problem.start[:3])
    whole = (moved + below) / problem.kinematics.mass_kg
    at_start = ca.Function("com", [q, base], [whole])(problem.start[problem.chain], problem.start[:3])
    clear = [
        _norm(thing.shape, ca.DM(thing.placement.rotation).T @ (p - ca.DM(thing.placement.translation)), r)
        for thing in things
        if thing.name != HANDLE
        for p, r in (*balls, *still)
    ]
    clear += _off_trunk(problem, trunk, balls)
    return whole - at_start + ca.DM(problem.com), ca.gradient(energy, q), ca.vertcat(*clear)


def _off_trunk(problem: Chain, trunk: tuple[Any, Any], balls: list[tuple[Any, float]]) -> list[Any]:
    box = problem.kinematics.trunk
    half, (rotation, position), middle = coal.Box(*(2 * np.array(box.b_m))), trunk, casadi().DM(box.a_m)
    # The first limb's inner end is always near the trunk, which it is joined to.
    return [_norm(half, rotation.T @ (p - position) - middle, r - MARGIN_M) for p, r in balls[1:]]


def _turn(axis: np.ndarray, angle: Any) -> Any:
    """Rotation about a fixed unit axis (Rodrigues)."""
    ca = casadi()
    k = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return ca.DM.eye(3) + ca.sin(angle) * ca.DM(k) + (1 - ca.cos(angle)) * ca.DM(k @ k)


def _norm(shape: Any, place: Any, radius_m: float) -> Any:
    """At least 1 where a ball at ``place`` in the shape's frame keeps clear of it."""
    ca = casadi()
    r = radius_m + MARGIN_M
    round_xy = ca.sqrt(place[0] ** 2 + place[1] ** 2 + 1e-8)
    if isinstance(shape, coal.Box):
        scaled = [place[k] / (float(shape.halfSide[k]) + r) for k in range(3)]
    elif isinstance(shape, coal.Sphere):
        return ca.sqrt(ca.sumsqr(place) + 1e-8) / (shape.radius + r)
    else:
        cap_m = shape.radius if isinstance(shape, coal.Capsule) else 0.0
        scaled = [round_xy / (shape.radius + r), place[2] / (shape.halfLength + cap_m + r)]
    return sum(value**ORDER for value in scaled) ** (1.0 / ORDER)


def on_soles(problem: Chain, point: Any) -> tuple[Any, Any, float]:
    """A point along the feet and from foot to foot, from their middle; half the way between the feet [m]."""
    left, right = (sole.translation[:2] for sole in problem.soles)
    forward = problem.soles[0].rotation[:2, 0] + problem.soles[1].rotation[:2, 0]
    forward = forward / np.linalg.norm(forward)
    aside = np.array([-forward[1], forward[0]])
    middle = (left + right) / 2
    off = [point[0] - middle[0], point[1] - middle[1]]
    far = float(abs((left - right) @ aside)) / 2
    return off[0] * forward[0] + off[1] * forward[1], off[0] * aside[0] + off[1] * aside[1], far
