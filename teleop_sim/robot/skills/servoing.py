"""A hand led by what is felt of it: straight lines of the tool in closed loop, with forces held by a leash.

Each tick the joint references move by resolved rates (Whitney, IEEE Trans. Man-Machine Systems 10 (1969), 47-53, with
damping after Nakamura and Hanafusa 1986) towards where the tool is to be, judged by where it is felt to be. They never
lead the felt angles by more than the leash: what the hand meets is then pushed with at most leash x servo stiffness a
joint, whatever the line asks.

Not modelled: noise of joint sensors; that the pelvis yields is felt, not planned.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from teleop_sim.robot.chain_ik import Solution, search
from teleop_sim.robot.pose_ik import PoseIk, PoseTarget, pose_target
from teleop_sim.robot.senses import feel
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.manipulate import Arm, plan_stance, rest_posture, smooth
from teleop_sim.world.belief import Load
from teleop_sim.world.plant import GRAVITY_M_S2

LEASH_RAD = 0.05
"""How far references may lead the felt joints: on Valkyrie's wrist 10 N m, on its shoulder 40 N m (measured in trials:
takes 12 of 12 handles, plugs 12 of 12)."""
YIELD_RAD = 0.004
"""Leash of an arm that gives way: some 5 N at Valkyrie's hand, more than friction and errors of weight (assumed)."""
GAIN_HZ = 4.0
"""Error of the tool's place and turn to its rate [1/s]; ten times slower than the control ticks."""
RATE_LIMIT_RAD_S = 1.0
"""Of the fastest joint (Valkyrie's wrists are limited to it)."""
PLACE_LIMIT_M = 0.05
TURN_LIMIT_RAD = 0.2
"""The most error that a tick tries to remove."""
DAMPING = 1e-4
TORSO_WEIGHT = 0.05
"""How much a torso joint moves for one of the arm's: torso and arms hang on it."""
REST_GAIN_HZ = 1.0
LIMIT_MARGIN_RAD = 0.01
"""Less than plans keep (0.03): what is felt must be put right even where a plan ends at a limit."""
UP = np.array([0.0, 0.0, 1.0])
FELT_TICKS = 10
"""Over which a wrist's force is averaged."""


@dataclass(frozen=True)
class Hold:
    """What the skill knows of a thing in the hand: its mass [kg], its centre from the handle (3,) [m], world axes.

    ``radius_m``: of the ball that it is told to be.
    """

    mass_kg: float
    centre_m: np.ndarray
    radius_m: float = 0.1


class Led:
    """One hand led by its felt pose. Scratch of one skill.

    Attributes:
        jaws: references of both hands' jaws; changed by the skill.
        goal: configuration ``q`` to which the joints are drawn where the tool leaves them free.
        tare_n: (3,) weight of the empty hand that the wrist bears [N], world axes.
        weight_n: upward force on what is held, without the hand's own weight, averaged [N].
    """

    def __init__(self, arm: Arm, leash_rad: float = LEASH_RAD) -> None:
        self.arm, self.leash_rad = arm, leash_rad
        self.jaws = arm.body.jaws
        kinematics = arm.kinematics
        names = (*kinematics.torso, *kinematics.arms[arm.side])
        self._places = kinematics.positions(names)
        self._at = np.array([arm.body.upper_names.index(name) for name in names])
        self._weights = np.where([name in kinematics.torso for name in names], TORSO_WEIGHT, 1.0)
        self._low = kinematics.lower[self._places - 7] + LIMIT_MARGIN_RAD
        self._high = kinematics.upper[self._places - 7] - LIMIT_MARGIN_RAD
        self._mount = next(m for m in arm.body.spec.model.hands if m.side == arm.side)
        self.goal = arm.reference()
        # As a real robot's: the empty hand's weight is known beforehand, not felt.
        self.tare_n = _hand_kg(arm) * GRAVITY_M_S2 * UP
        self._forces: list[np.ndarray] = []
        self._told_kg = sum(x.mass_kg for x in arm.body.loads if x.link == self._mount.palm)
        self._told = next((x for x in arm.body.loads if x.link == self._mount.palm), None)

    # Feeling -------------------------------------------------------------------------------------------------------

    def force(self) -> np.ndarray:
        """What the hand gets from the arm, less the empty hand's weight (3,) [N], world axes, averaged."""
        mean: np.ndarray = np.mean(self._forces, axis=0) - self.tare_n if self._forces else np.zeros(3)
        return mean

    def feel_wrist(self) -> None:
        """Take one reading of the wrist's sensor."""
        palm = self.arm.hand()[0] @ self._mount.rotation.T
        force = palm @ feel(self.arm.body).wrists[self.arm.side].force_n
        self._forces = [*self._forces[-FELT_TICKS + 1 :], force]

    @property
    def weight_n(self) -> float:
        """Upward part of ``force``."""
        return float(self.force()[2])

    # Leading -------------------------------------------------------------------------------------------------------

    def towards(self, position: np.ndarray, rotation: np.ndarray, velocity: np.ndarray | None = None) -> Tick:
        """References that bring the tool there: position (3,) [m], rotation (3, 3), velocity (3,) [m/s] to add."""
        arm, dt = self.arm, self.arm.body.tick_s
        q = arm.measured()
        now, place = arm.kinematics.tool_pose(q, arm.side)
        twist = np.concatenate(
            [
                GAIN_HZ * _short(position - place, PLACE_LIMIT_M) + (0.0 if velocity is None else velocity),
                GAIN_HZ * _short(now @ pin.log3(now.T @ rotation), TURN_LIMIT_RAD),
            ]
        )
        reference = arm.body.posture[self._at]
        pull = REST_GAIN_HZ * (self.goal[self._places] - reference)
        rate = self._rates(self._jacobian(q), twist, pull, reference)
        rate *= min(1.0, RATE_LIMIT_RAD_S / max(float(np.abs(rate).max()), 1e-9))
        felt = q[self._places]
        leashed = np.clip(reference + rate * dt, felt - self.leash_rad, felt + self.leash_rad)
        posture, rates = arm.body.posture.copy(), np.zeros(len(arm.body.posture))
        posture[self._at] = np.clip(leashed, self._low, self._high)
        rates[self._at] = rate
        self.feel_wrist()
        return Tick(posture, rates, jaws=self.jaws)

    def yielding(self) -> np.ndarray:
        """Upper-body references (n_upper,) that let this arm be pushed: they follow it on a leash of ``YIELD_RAD``."""
        posture = self.arm.body.posture.copy()
        felt = self.arm.body.upper()[self._at]
        posture[self._at] = np.clip(posture[self._at], felt - YIELD_RAD, felt + YIELD_RAD)
        return posture

    def _jacobian(self, q: np.ndarray) -> np.ndarray:
        """(6, chain) of the tool in world axes."""
        kinematics = self.arm.kinematics
        model, data = kinematics.model, kinematics.data
        tool = kinematics.tools[self.arm.side]
        frame = pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL_WORLD_ALIGNED)
        return np.asarray(frame[:, self._places - 1])

    def _rates(self, jacobian: np.ndarray, twist: np.ndarray, pull: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Joint rates (chain,) for a twist; a joint at its limit does not go beyond, and the others take its share."""
        weights = self._weights
        for _ in range(2):
            weighted = jacobian * weights
            normal = weighted @ jacobian.T + DAMPING * np.eye(6)
            drawn = np.where(weights > 0, pull, 0.0)
            rate = weights * (jacobian.T @ np.linalg.solve(normal, twist - jacobian @ drawn)) + drawn
            ahead = reference + rate * self.arm.body.tick_s
            out = ((ahead < self._low) & (rate < 0)) | ((ahead > self._high) & (rate > 0))
            if not out.any():
                break
            weights = np.where(out, 0.0, weights)
        return np.asarray(np.where(weights > 0, rate, 0.0))

    # The load ------------------------------------------------------------------------------------------------------

    def tell(self, mass_kg: float, hold: Hold | None = None) -> None:
        """Tell the controller that so much now hangs in this hand; without ``hold`` where it was told to be before."""
        palm, body = self._mount.palm, self.arm.body
        others = tuple(x for x in body.loads if x.link != palm)
        self._told_kg = max(0.0, mass_kg)
        if hold is not None:
            rotation, position = self.arm.hand()
            turned = rotation @ self._mount.rotation.T
            origin = position - turned @ self._mount.position_m
            x, y, z = (float(v) for v in turned.T @ (position + hold.centre_m - origin))
            self._told = Load(palm, self._told_kg, (x, y, z), hold.radius_m)
        if self._told is None or self._told_kg == 0.0:
            body.carry(others)
        else:
            told = self._told
            body.carry((*others, Load(palm, self._told_kg, told.at_m, told.radius_m)))

    def follow_weight(self, hold: Hold | None, most_kg: float, slew_kg_s: float = 6.0) -> None:
        """Let the told mass follow the felt weight; so it is the hand's as it leaves the ground, and the ground's as
        it comes down.
        """
        felt_kg = min(max(self.weight_n / GRAVITY_M_S2, 0.0), most_kg)
        step = slew_kg_s * self.arm.body.tick_s
        self.tell(self._told_kg + min(max(felt_kg - self._told_kg, -step), step), hold)

    @property
    def told_kg(self) -> float:
        """Mass in this hand as the controller was told [kg]."""
        return self._told_kg


def _hand_kg(arm: Arm) -> float:
    """Mass beyond the wrist's sensor, as the planning model has it."""
    model, data = arm.kinematics.model, arm.kinematics.data
    pin.computeSubtreeMasses(model, data)
    return float(data.mass[model.getJointId(arm.kinematics.arms[arm.side][-1])])


def _short(vector: np.ndarray, limit: float) -> np.ndarray:
    return np.asarray(vector * min(1.0, limit / max(float(np.linalg.norm(vector)), 1e-12)))


def line(
    led: Led,
    position: np.ndarray,
    rotation: np.ndarray,
    duration_s: float,
    until: Callable[[], bool] | None = None,
    settle_s: float = 0.2,
) -> Generator[Tick, None, bool]:
    """Lead the tool straight to a pose, from rest to rest, then hold it there; return whether ``until`` ended it."""
    now, start = led.arm.hand()
    turn = pin.log3(now.T @ rotation)
    dt = led.arm.body.tick_s
    count, rest = max(1, round(duration_s / dt)), round(settle_s / dt)
    for k in range(count + rest):
        before, share = smooth(k / count), smooth((k + 1) / count)
        place = start + share * (position - start)
        velocity = (share - before) / dt * (position - start)
        yield led.towards(place, now @ pin.exp3(share * turn), velocity)
        if until is not None and until():
            return True
    return False


def stay(led: Led, seconds: float, until: Callable[[], bool] | None = None) -> Generator[Tick, None, bool]:
    """Keep the references as they are, and feel; return whether ``until`` ended it."""
    posture = led.arm.body.posture.copy()
    for _ in range(round(seconds / led.arm.body.tick_s)):
        led.feel_wrist()
        yield Tick(posture, jaws=led.jaws)
        if until is not None and until():
            return True
    return False


@dataclass(frozen=True)
class Posed:
    """A posture for a pose of the tool, and the solver that found it."""

    solution: Solution
    solver: PoseIk


def posture_for(
    arm: Arm, target: PoseTarget, rng: np.random.Generator, start: np.ndarray | None = None, restarts: int = 6
) -> Posed:
    """The best posture found for a pose of the tool: torso and arm, feet and centre of mass held."""
    _, stance = plan_stance(arm)
    rest = rest_posture(arm, stance)
    solver = PoseIk(arm.kinematics, arm.side, stance, rest, torso=True)
    return Posed(search(solver, rest if start is None else start, target, rng, restarts), solver)


def path_back(posed: Posed, target: PoseTarget, offset: np.ndarray, rows: int = 8) -> tuple[np.ndarray, Solution]:
    """Postures (rows, nq) along a line from ``target`` by ``offset`` (3,) [m], and the last one's errors."""
    found, path = posed.solution, []
    for share in np.linspace(0.0, 1.0, rows):
        found = posed.solver.solve(found.q, pose_target(target.position + share * offset, target.rotation), 15)
        path.append(found.q)
    return np.array(path), found
