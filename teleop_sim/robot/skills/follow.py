"""Follow: turn a held handle round its circle until a signal of the world is at its target.

The robot knows the handle only by its own hand: the tool's measured place, projected on the believed circle, is the
handle angle. How far the signal goes with the handle, and how late, is not known: the ratio is learned on the way.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, field

import numpy as np

from teleop_sim.robot import law
from teleop_sim.robot.body import Body
from teleop_sim.robot.circle_table import Circle, CircleTable, circle_of
from teleop_sim.robot.commands import Follow
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.manipulate import JAW_SHUT, Arm, arm_of, smooth, table_of
from teleop_sim.world.plant import GRAVITY_M_S2

FULL_SPEED_RAD_S = 2 * np.pi / 12
"""One turn in 12 s: measured to hold for 3.5 turns either way."""
START_SPEED_RAD_S = 0.3
"""Until the ratio is learned (assumed)."""
SPEED_UP_RAD_S2, SLOW_DOWN_RAD_S2 = 0.4, 1.0
PUSH_N = 20.0
PUSH_N_S = 40.0
"""Feed-forward force along the path, the middle of 16 N to 24 N that a wheel of 2 to 3 N m needs, and its slew."""
LAG_FREE_RAD, LAG_LOST_RAD = 0.25, 0.9
"""The hand may trail the reference by this much at full speed; beyond the second the grip is lost (measured)."""
OFF_PATH_M = 0.06
"""Hand to believed circle: more than the cage's opening, so it cannot be round the handle."""
TOUCH_N = 3.0
UNTOUCHED_RAD = 0.35
"""A handle resists all the way; a hand that feels nothing for 4 cm of path holds nothing (assumed)."""
STILL_S, STILL_RAD = 5.0, 0.005
APPROACH_S = 2.0
"""Time constant towards the target: twice the slowest signal's lag of 1 s, so the loop is damped by 0.71."""
INNER = 0.25
FINAL = 0.6
"""Shares of the tolerance: inside the first the hand stops, inside the second the signal must come to rest."""
REST_S = 2.5
RELAX_S = 0.6
EASE_S = 1.0
"""Waits for the signal's lag to pass, for the hand to lose its load, for the start's posture to become the table's
(all assumed)."""
RATIO_WINDOW_S = 1.0

CAUSES = {
    "reached": "signal at rest in its tolerance",
    "grip_lost": "the hand left the handle or lost touch with it",
    "no_motion": "the signal does not move towards its target",
    "timed_out": "time limit",
}


@dataclass(frozen=True)
class FollowReport:
    """What the robot knows at the end.

    Attributes:
        turned_rad: how far the hand went, anticlockwise positive.
        angle_rad: handle angle where the hand last felt the handle: where to look for it after a lost grip.
        signal, error: of the watched status value, and what is missing to the target.

    """

    turned_rad: float
    angle_rad: float
    signal: float
    error: float


@dataclass
class Cranking:
    """What changes from tick to tick.

    Attributes:
        place: of the reference on the circle, any number of turns [rad]. velocity: of it [rad/s].
        hand: measured handle angle, unwrapped [rad]. signal: the watched status value.
        push_n: feed-forward force along the motion.
        touched: hand angle at which a force was last felt.
        ticks: since the start. moved: (tick, signal) when the signal last moved.
        ratio: learned change of the signal per change of the handle angle, never negative; 0 is unknown.
        braked: whether the target has slowed the hand; slopes are too steep from then on.
        history: recent (hand, signal), one a tick.

    """

    place: float
    hand: float
    signal: float
    velocity: float = 0.0
    push_n: float = 0.0
    touched: float = 0.0
    ticks: int = 0
    moved: tuple[int, float] = (0, 0.0)
    ratio: float = 0.0
    braked: bool = False
    history: list[tuple[float, float]] = field(default_factory=list)


def clamp(value: float, low: float, high: float) -> float:
    """``value`` kept within [low, high]."""
    return min(max(value, low), high)


def watched(body: Body, signal: str) -> float:
    """A status value, NaN when the task sends none."""
    return float(body.status().get(signal, np.nan))


class Follower:
    """One ``Follow``: the table, the senses and the rules that end it."""

    def __init__(self, arm: Arm, command: Follow, table: CircleTable, start: float, signal: float) -> None:
        self.arm, self.command = arm, command
        self.circle = circle_of(command.affordance)
        # One array, so that a tick interpolates once: postures, torques of a newton, shifts of the ZMP by it.
        leans = zmp_shifts(arm, table, self.circle)
        self.rows = np.hstack([table.q[:, arm.upper], table.push[:, arm.upper - 1], leans])
        self.slopes = np.roll(self.rows, -1, axis=0) - self.rows
        self.joints = len(arm.upper)
        self.row = arm.body.stand
        self.jaws = arm.jaws(JAW_SHUT)
        self.start = start
        self.first_error = command.target - signal
        self.offset = arm.body.posture - table.at(start)[arm.upper]
        self.now = Cranking(place=start, hand=start, signal=signal, touched=start, moved=(0, signal))

    def sense(self) -> str:
        """Read hand and signal. Return an outcome that ends the motion, or nothing."""
        now, body = self.now, self.arm.body
        angle, off_m = self.circle.polar(self.arm.tool())
        now.hand += math.remainder(angle - now.hand, 2 * math.pi)
        signal = now.signal = watched(body, self.command.signal)
        now.ticks += 1
        if body.hand_force(self.command.side) > TOUCH_N:
            now.touched = now.hand
        if abs(signal - now.moved[1]) > STILL_RAD:
            now.moved = (now.ticks, signal)
        self._learn(signal)
        lag, untouched = abs(now.place - now.hand), abs(now.hand - now.touched)
        if off_m > OFF_PATH_M or lag > LAG_LOST_RAD or untouched > UNTOUCHED_RAD:
            return "grip_lost"
        away = abs(self.error()) > abs(self.first_error) + self.command.tolerance
        if away or (now.ticks - now.moved[0]) * body.tick_s > STILL_S:
            return "no_motion"
        return "timed_out" if now.ticks * body.tick_s > self.command.time_limit_s else ""

    def _learn(self, signal: float) -> None:
        """Steepest slope of the signal against the hand: a lag hides part of it, but never adds while speed grows."""
        now = self.now
        now.history.append((now.hand, signal))
        if len(now.history) * self.arm.body.tick_s <= RATIO_WINDOW_S:
            return
        hand, before = now.history.pop(0)
        if not now.braked and abs(now.hand - hand) > 0.5 * START_SPEED_RAD_S * RATIO_WINDOW_S:
            now.ratio = max(now.ratio, abs((signal - before) / (now.hand - hand)))

    def renew(self) -> None:
        """Begin again after a rest that ended off target: what was felt before counts no more."""
        now = self.now
        now.touched, now.moved, now.history = now.hand, (now.ticks, now.signal), []

    def error(self) -> float:
        """What is missing to the target."""
        return float(self.command.target - self.now.signal)

    def way(self) -> float:
        """Which way to turn now: as commanded, and back after an overshoot."""
        return math.copysign(1.0, self.command.direction * self.error() * self.first_error)

    def advance(self) -> Tick:
        """Move the reference on: slower near the target, when the hand trails, and until the ratio is known."""
        now, way, tick_s = self.now, self.way(), self.arm.body.tick_s
        wanted = FULL_SPEED_RAD_S if now.ratio > 0.0 else START_SPEED_RAD_S
        landing = abs(self.error()) / (max(now.ratio, 1e-3) * APPROACH_S)
        if landing < wanted:
            wanted, now.braked = landing, True
        lag = way * (now.place - now.hand)
        wanted *= clamp((LAG_LOST_RAD - lag) / (LAG_LOST_RAD - LAG_FREE_RAD), 0.0, 1.0)
        change = way * wanted - now.velocity
        most = (SPEED_UP_RAD_S2 if change * now.velocity >= 0.0 else SLOW_DOWN_RAD_S2) * tick_s
        now.velocity += clamp(change, -most, most)
        now.place += now.velocity * tick_s
        now.push_n += clamp(way * PUSH_N - now.push_n, -PUSH_N_S * tick_s, PUSH_N_S * tick_s)
        return self.tick()

    def relax(self) -> Tick:
        """Bring the reference back to the hand and take the push off, so that nothing springs when the hand opens."""
        now, tick_s = self.now, self.arm.body.tick_s
        now.velocity = 0.0
        now.place += clamp(now.hand - now.place, -START_SPEED_RAD_S * tick_s, START_SPEED_RAD_S * tick_s)
        now.push_n -= clamp(now.push_n, -PUSH_N_S * tick_s, PUSH_N_S * tick_s)
        return self.tick()

    def tick(self) -> Tick:
        """The table's posture at the reference's place, eased in from the posture at the start."""
        now, rows, n = self.now, len(self.rows), self.joints
        place = now.place / (2 * math.pi) * rows
        row = math.floor(place)
        slope = self.slopes[row % rows]
        values = self.rows[row % rows] + (place - row) * slope
        posture, torque = values[:n], now.push_n * values[n : 2 * n]
        stance = self.row.copy()
        stance[law.ZMP : law.ZMP + 2] += now.push_n * values[2 * n :]
        ease = 1.0 - smooth(now.ticks * self.arm.body.tick_s / EASE_S)
        if ease > 0.0:
            posture = posture + ease * self.offset
        return Tick(posture, slope[:n] * (now.velocity * rows / (2 * math.pi)), torque, self.jaws, stance)

    def report(self) -> FollowReport:
        """What the robot knows at the end."""
        now = self.now
        return FollowReport(now.hand - self.start, math.remainder(now.touched, 2 * np.pi), now.signal, self.error())


def zmp_shifts(arm: Arm, table: CircleTable, circle: Circle) -> np.ndarray:
    """How far the ZMP must move for each newton of push, (rows, 2) [m/N], so that the centre of mass stays.

    Moments about the ZMP p of a robot at rest, with the hand's force F on the world at r and the centre of mass at c:
    (c - p) x (-m g) + (r - p) x (-F) = 0, so p - c = -(h F_xy - (r - c)_xy F_z) / (m g), h the hand's height.
    """
    angles = 2 * math.pi * np.arange(len(table.q)) / len(table.q)
    force = np.array([circle.direction(angle) for angle in angles])
    place = np.array([circle.place(angle).position for angle in angles])
    com, ground_z_m = arm.body.stand[law.XI : law.XI + 2], arm.body.ground_z_m()
    height = place[:, 2:] - ground_z_m
    weight_n = arm.kinematics.mass_kg * GRAVITY_M_S2
    return np.asarray(-(height * force[:, :2] - (place[:, :2] - com) * force[:, 2:]) / weight_n)


def follow(body: Body, command: Follow, rng: np.random.Generator) -> Motion:
    """Turn a held handle. Ends ``reached``, ``grip_lost``, ``no_motion``, ``timed_out`` or ``no_plan``.

    Data: ``FollowReport`` (None without a plan). No target is reached in passing: the hand stops, and the signal must
    come to rest within the tolerance.
    """
    arm = arm_of(body, command.side)
    signal = watched(body, command.signal)
    if not np.isfinite(signal):
        return Done("no_motion", f"no status value {command.signal!r} is received")
    angle = circle_of(command.affordance).angle_of(arm.tool())
    table = table_of(arm, command.affordance)
    if not table.usable:
        return Done("no_plan", f"the handle's circle is out of reach by {table.position_error_m * 1e3:.0f} mm")
    follower = Follower(arm, command, table, angle, signal)
    outcome = yield from _until_reached(follower)
    for _ in range(round(RELAX_S / body.tick_s)):
        yield follower.relax()
    report = follower.report()
    turned_deg = np.degrees(report.turned_rad)
    return Done(outcome, f"{CAUSES[outcome]}; turned {turned_deg:.0f} degrees, {report.error:+.3f} left", report)


def _until_reached(follower: Follower) -> Generator[Tick, None, str]:
    """Turn until the signal rests inside the tolerance, or something ends it. Return the outcome."""
    tolerance, rest_ticks = follower.command.tolerance, round(REST_S / follower.arm.body.tick_s)
    while True:
        while abs(follower.error()) > INNER * tolerance:
            ended = follower.sense()
            if ended:
                return ended
            yield follower.advance()
        for _ in range(rest_ticks):
            follower.sense()
            yield follower.relax()
        if not np.isfinite(follower.error()):
            return "no_motion"
        if abs(follower.error()) <= FINAL * tolerance:
            return "reached"
        follower.renew()
