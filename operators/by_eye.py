"""A hand moved by eye, with a template to say where it belongs: Cartesian teleoperation, move and wait.

Movements are short and open-loop; what each has done is seen in where the hand then is, by the robot's own joints. So a
goal takes a round trip a movement (Ferrell 1965, ``manual.py``).

Not modelled: turning the hand by eye; feeling forces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from teleop_sim.channel.messages import CartesianTarget, HandPose, Side
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.deeds import Deed, Deeds, only
from teleop_sim.operators.handling import Handling
from teleop_sim.operators.layer_figures import LayerFigures
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, Triple, pose_of, rotation

PUSH_M = 0.2
"""How far a hand goes that pushes a door ajar by hand (assumed: 12 degrees at 0.85 m, and some)."""
STANDS_STILL = 3
"""Movements in a row that bring nothing before a person gives up (assumed)."""


@dataclass(frozen=True)
class HandByEye:
    """Moves a hand (``docs/operator.md``).

    Attributes:
        template: of the thing. thing: how it is dealt with. side: of the hand.
        timing: of the person. figures: of movements.

    """

    template: Template
    thing: Handling
    side: Side
    timing: OperatorTiming
    figures: LayerFigures

    def hand(self, belief: Belief) -> HandPose | None:
        """Where the hand is, as far as told."""
        found = belief.work.hands.get(self.side)
        return None if found is None else found[1]

    def reach(self, belief: Belief, goal: str, pose: Pose, rng: np.random.Generator) -> Deeds:
        """Bring the hand to where a goal wants it, or round with the thing; ``pose``: of the template."""
        hand = self.hand(belief)
        if hand is None:
            return False
        if goal == "turn":
            return (yield from self._arc(belief, pose, rng))
        into = pose.matrix[:, 0]
        if goal == "push":
            target = np.array(hand.position_m) + PUSH_M * into
        else:
            back = self.figures.before_m if goal == "pregrasp" else 0.0
            target = np.array(self.thing.place(pose, hand.position_m)) - back * into
        return (yield from self._straight(belief, target, rng))

    def _straight(self, belief: Belief, target: np.ndarray, rng: np.random.Generator) -> Deeds:
        still = 0
        for _ in range(self.figures.moves):
            hand = self.hand(belief)
            assert hand is not None
            left = target - np.array(hand.position_m)
            away_m = float(np.linalg.norm(left))
            if away_m <= self.figures.tolerance_m:
                return True
            wanted = left * min(1.0, self.figures.longest_m / away_m)
            off = self.figures.error * float(np.linalg.norm(wanted)) * rng.standard_normal(3)
            place = _triple(np.array(hand.position_m) + wanted + off)
            came = yield self._nudge(CartesianTarget(self.side, place, hand.rotation_rad))
            now = self.hand(belief)
            closer = now is not None and away_m - float(np.linalg.norm(target - np.array(now.position_m)))
            still = 0 if came and closer > self.figures.tolerance_m / 2 else still + 1
            if still >= STANDS_STILL:
                return False
        return False

    def _arc(self, belief: Belief, pose: Pose, rng: np.random.Generator) -> Deeds:
        """Round the axis in small turns, until the hand has gone far enough round it."""
        affordance = self.template.affordance(self.thing.affordances["turn"])
        axis, origin = (np.array(v) for v in affordance.at(pose))
        way = math.copysign(self.figures.arc_rad, affordance.amount)
        gone, still, start = 0.0, 0, belief.work.turned() if self.thing.adds else 0.0
        for _ in range(4 * self.figures.moves):
            hand = self.hand(belief)
            assert hand is not None
            if start + gone >= self.thing.enough["turn"]:
                return True
            turn = rotation(way * axis)
            arm = np.array(hand.position_m) - origin
            off = self.figures.error * self.figures.tolerance_m * rng.standard_normal(3)
            next_pose = pose_of(origin + turn @ arm + off, turn @ rotation(hand.rotation_rad))
            yield self._nudge(CartesianTarget(self.side, next_pose.position_m, next_pose.rotation_rad))
            now = self.hand(belief)
            step = abs(_angle(axis, arm, np.array(now.position_m) - origin)) if now is not None else 0.0
            gone, still = gone + step, 0 if step > abs(way) / 4 else still + 1
            if still >= STANDS_STILL:
                return False
        return False

    def _nudge(self, target: CartesianTarget) -> Deed:
        work_s = self.timing.approach_s() + self.timing.command_s()
        return Deed("teleoperation", "move the hand", work_s, only(target), "hand", self.figures.motion_s)


def _angle(axis: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """From (3,) to (3,) about an axis [rad]."""
    a, b = a - axis * float(axis @ a), b - axis * float(axis @ b)
    return math.atan2(float(axis @ np.cross(a, b)), float(a @ b))


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z
