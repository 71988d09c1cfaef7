"""One act under way: what it feels, how it moves on, what ends it.

A thing that guides the hand pushes it sideways where the believed path is wrong: the hand gives way, and learns from
where it is led where the axis is. A tool that nothing guides is kept on its path. The resistance felt along the path is
fed forward: a thing that is stuck is pushed harder and harder, until it moves or the limit of force ends it.

Source of giving way sideways and keeping on along the path: Mason, IEEE Trans. SMC 11 (1981), 418-432 (compliance by
directions); of the law by which the hand gives way, velocity for force: Whitney, J. Dyn. Sys. Meas. Control 99 (1977),
91-97.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from teleop_sim.robot import law
from teleop_sim.robot.affordance import metres_per_unit, moved
from teleop_sim.robot.affordance_table import BEYOND_M, MotionTable, Way
from teleop_sim.robot.axis_fit import axis_fit
from teleop_sim.robot.commands import Act
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.manipulate import PEAK_RATE_RAD_S, Arm, smooth
from teleop_sim.world.plant import GRAVITY_M_S2
from teleop_sim.world.senses import wrenches

SPEED_M_S, TIED_M_S = 0.05, 0.03
"""Of the tool along its path: a crank's turn takes 15 s (assumed; twelve were measured to hold). The
second of a hand round a bar: the body has to follow what it feels, and THORMANG3 fell less (measured)."""
SPEED_UP_M_S2, SLOW_DOWN_M_S2, APPROACH_S = 0.05, 0.15, 1.0
"""How its speed changes, and the time constant towards the end (assumed)."""
LAG_FREE_M, LAG_STOP_M = 0.02, 0.05
"""The hand may trail its reference by this much at full speed; at the second the reference waits for it (assumed)."""
DONE_M = 0.002
"""The end is reached within it: as much as a handle plays in a closed cage."""
PUSH_N_S = 40.0
"""Slew of the force fed forward: as for cranks."""
PUSH_N_M = 400.0
"""More than is felt is pushed where the hand trails by more than it may: hips and ankles give way to the push, and a
light robot with its arm at a third of its strength would be stuck (assumed: 12 N at most)."""
FEEL_S, LEAN_S, TIED_S = 0.06, 0.2, 0.5
"""Time constants of the felt force: for the loop, for the balance, and for the balance of a hand that a bar ties to a
thing. What is felt then moves the body, and that the force: of 30 trials of THORMANG3 at a door with a template 1.25 cm
off 9 failed with 0.2 s, 5 with 0.5 and with 0.8 (measured)."""
YIELD_M_NS, YIELD_FROM_N = 0.002, 2.0
"""How fast a guided hand gives way sideways: 10 N move it by 16 mm/s (assumed)."""
FORGET_S = 0.5
"""How fast what was sideways and has come to lie along the path is taken back (assumed)."""
KEEP_1_S = 1.5
"""How fast a tool's felt error sideways is worked off (assumed)."""
ASIDE_M, OFF_PATH_M = 0.12, 0.15
"""The hand never gives way further: more than any template is wrong. Beyond the second it has lost the thing
(assumed)."""
TOUCH_N, UNTOUCHED_M = 3.0, 0.04
"""A thing resists all the way; a hand that feels nothing for so far holds nothing (assumed)."""
LEARN_M_S = 0.03
"""How fast the reference follows what is learned of the axis (assumed: less than the hand's own speed)."""
STILL_S, STILL_M = 4.0, 0.003
"""A thing that goes less far in that time does not move (assumed: the push grows by 160 N in it)."""
TWIST_RAD_S2 = 2.5
"""The most that is asked: soles can twist the body by 4 to 6 rad/s^2 at friction 0.4 (``teleop_sim.robot.law``), and at
twice as much THORMANG3 slid and fell at valves of 3 to 5 N m (measured)."""
EASE_S = 1.0
"""For the start's posture to become the table's (assumed: as cranking's)."""


@dataclass
class Moving:
    """What changes from tick to tick; lengths are along the path, positive in the sense of the motion.

    Attributes:
        place_m, velocity_m_s: of the reference. hand_m: of the felt tool, ``amount`` the same in the affordance's unit.
        force: (3,) of the hand on the thing, felt [N]; ``slow`` smoother; ``peak_n`` its greatest size.
        push_n: feed-forward along the motion.
        aside: (3,) how far the reference is moved off the believed path [m]; ``off_m`` the felt tool at most.
        slack_m: how far the hand went before it first felt the thing: the thing has not gone along.
        touched_m, moved_m, moved_tick: where a force was last felt, where and when the thing last moved.
        bent: (3,) how far the learned path is from the believed one at the reference [m].
        sway: (3,) how far the pelvis has carried the planned posture's hand away from where it was planned [m].
        ticks: since the start.

    """

    place_m: float = 0.0
    velocity_m_s: float = 0.0
    hand_m: float = 0.0
    amount: float = 0.0
    push_n: float = 0.0
    peak_n: float = 0.0
    off_m: float = 0.0
    slack_m: float = 0.0
    touched_m: float = -1.0
    moved_m: float = 0.0
    moved_tick: int = 0
    ticks: int = 0
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    slow: np.ndarray = field(default_factory=lambda: np.zeros(3))
    aside: np.ndarray = field(default_factory=lambda: np.zeros(3))
    bent: np.ndarray = field(default_factory=lambda: np.zeros(3))
    sway: np.ndarray = field(default_factory=lambda: np.zeros(3))
    deviation: np.ndarray = field(default_factory=lambda: np.zeros(3))


def clamp(value: float, low: float, high: float) -> float:
    """``value`` kept within [low, high]."""
    return min(max(value, low), high)


class Actor:
    """One ``Act``: the table, the senses and the rules that end it."""

    def __init__(self, arm: Arm, command: Act, table: MotionTable, way: Way) -> None:
        self.arm, self.command, self.table, self.way = arm, command, table, way
        self.unit_m = metres_per_unit(way.affordance, way.start)
        self.sign = math.copysign(1.0, way.amount)
        self.length_m = abs(way.amount) * self.unit_m
        self.row_m = abs(float(table.amounts[1] - table.amounts[0])) * self.unit_m
        self.first_m = -abs(float(table.amounts[0])) * self.unit_m
        self.upper = table.q[:, arm.upper]
        self.push = table.push[:, :, arm.upper - 1]
        self.aside = table.aside[:, :, arm.upper - 1]
        self.jaws = arm.body.jaws
        self.palm = palm_of(arm)
        self.weight_n = hand_weight_n(arm) + (command.usability.mass_kg * GRAVITY_M_S2 if command.usability else 0.0)
        self.offset = arm.body.posture - self._row(0.0)[0]
        self.row = arm.body.stand
        self.spin_kg_m2 = spin_inertia(arm)
        self.now = Moving()
        # A hand round a bar goes on holding what it has held: a lever against its spring.
        self.torque = body_torque(arm)
        self.lean_s, self.speed_m_s = (TIED_S, TIED_M_S) if command.rigid else (LEAN_S, SPEED_M_S)
        self.held = self._wrist() if command.rigid else np.zeros(3)
        self.now.force, self.now.slow = self.held.copy(), self.held.copy()
        self.axis = axis_fit(way.affordance, way.start)
        if command.rigid:
            self.now.push_n = float(self.held @ self._direction())

    # Feeling -------------------------------------------------------------------------------------------------------

    def sense(self) -> str:
        """Read hand and wrist. Return an outcome that ends the motion, or nothing."""
        now, body = self.now, self.arm.body
        now.ticks += 1
        tool = self.arm.tool()
        if self.command.usability is None:
            self.axis = self.axis.seen(tool, now.amount)
        now.amount, now.deviation = self.axis.felt(tool, now.amount)
        now.hand_m = self.sign * now.amount * self.unit_m
        now.off_m = max(now.off_m, float(np.linalg.norm(now.deviation + now.bent)))
        force = self._wrist()
        now.force = now.force + (force - now.force) * min(1.0, body.tick_s / FEEL_S)
        now.slow = now.slow + (force - now.slow) * min(1.0, body.tick_s / self.lean_s)
        now.peak_n = max(now.peak_n, float(np.linalg.norm(force)))
        self._touch(body.hand_force(self.arm.side))
        if abs(now.hand_m - now.moved_m) > STILL_M:
            now.moved_m, now.moved_tick = now.hand_m, now.ticks
        return self._ended(float(np.linalg.norm(force - self.held)))

    def _touch(self, force_n: float) -> None:
        now = self.now
        if force_n > TOUCH_N:
            now.touched_m = now.hand_m
        elif now.touched_m < 0.0:
            now.slack_m = clamp(now.hand_m, now.slack_m, BEYOND_M)

    def _ended(self, force_n: float) -> str:
        now, tick_s = self.now, self.arm.body.tick_s
        if force_n > self.command.force_limit_n:
            return "force_limit"
        if abs(now.hand_m - max(now.touched_m, 0.0)) > UNTOUCHED_M or float(np.linalg.norm(now.deviation)) > OFF_PATH_M:
            return "grip_lost"
        if (now.ticks - now.moved_tick) * tick_s > STILL_S:
            return "no_motion"
        return "timed_out" if now.ticks * tick_s > self.command.time_limit_s else ""

    def _wrist(self) -> np.ndarray:
        """Force (3,) of the hand on the thing [N], in the odometry frame: what the arm gives beyond the weight."""
        kinematics = self.arm.kinematics
        turn = kinematics.data.oMi[kinematics.carriers[self.palm]].rotation
        (wrist,) = wrenches(self.arm.body.plant, (self.palm,))
        force = turn @ wrist.force_n
        force[2] -= self.weight_n
        return np.asarray(force)

    def missing_m(self) -> float:
        """What is left of the path."""
        return self.length_m + self.now.slack_m - self.now.hand_m

    # Moving --------------------------------------------------------------------------------------------------------

    def advance(self) -> Tick:
        """Move the reference on: slower near the end and when the hand trails."""
        now, tick_s = self.now, self.arm.body.tick_s
        left_m = self.missing_m()
        fastest = PEAK_RATE_RAD_S / max(float(np.abs(self._row(now.place_m)[1]).max()), 1e-9)
        fastest = min(self.speed_m_s, fastest)
        wanted = clamp(left_m / APPROACH_S, -fastest, fastest)
        lag_m = math.copysign(1.0, left_m) * (now.place_m - now.hand_m)
        wanted *= clamp((LAG_STOP_M - lag_m) / (LAG_STOP_M - LAG_FREE_M), 0.0, 1.0)
        change = wanted - now.velocity_m_s
        most = (SPEED_UP_M_S2 if change * now.velocity_m_s >= 0.0 else SLOW_DOWN_M_S2) * tick_s
        now.velocity_m_s += clamp(change, -most, most)
        self._place(now.place_m + now.velocity_m_s * tick_s)
        resisted = float(now.force @ self._direction())
        goal = clamp(resisted + PUSH_N_M * max(lag_m - LAG_FREE_M, 0.0), 0.0, 2.0 * self.command.force_limit_n)
        now.push_n += clamp(goal - now.push_n, -PUSH_N_S * tick_s, PUSH_N_S * tick_s)
        self._step_aside(tick_s)
        return self.tick()

    def relax(self) -> Tick:
        """Bring the reference back to the hand and take the push off, so that nothing springs when the hand opens.

        A tool stays where it is: nothing but the arm holds it up.
        """
        now, tick_s = self.now, self.arm.body.tick_s
        now.velocity_m_s = 0.0
        if self.command.usability is not None:
            self._step_aside(tick_s, at_rest=self.command.rigid)
            return self.tick()
        self._place(now.place_m + clamp(now.hand_m - now.place_m, -SPEED_M_S * tick_s, SPEED_M_S * tick_s))
        now.push_n -= clamp(now.push_n, -PUSH_N_S * tick_s, PUSH_N_S * tick_s)
        self._step_aside(tick_s)
        return self.tick()

    def _place(self, place_m: float) -> None:
        """The table ends a little beyond what was asked for."""
        self.now.place_m = clamp(place_m, self.first_m, self.first_m + self.row_m * (len(self.upper) - 1))

    def _direction(self) -> np.ndarray:
        return self.sign * self.axis.course(self.now.amount)

    def _bend(self, tick_s: float) -> None:
        """Follow what has been learned of the axis."""
        now, amount = self.now, self.sign * self.now.place_m / self.unit_m
        believed = moved(self.way.affordance, amount, self.way.start)
        change = self.axis.at(amount) - believed - now.bent
        now.bent = now.bent + change * min(1.0, LEARN_M_S * tick_s / max(float(np.linalg.norm(change)), 1e-9))

    def _step_aside(self, tick_s: float, at_rest: bool = False) -> None:
        """Give way to what guides the hand, or bring back a tool that nothing guides."""
        now, along = self.now, self._direction()
        self._bend(tick_s)
        if self.command.usability is None:
            rate = self._yielding(along, YIELD_FROM_N)
            # What was sideways a quarter of a turn ago is along the path now, and would hold the hand back.
            rate = rate - (now.aside @ along) / FORGET_S * along
        else:
            rate = np.zeros(3) if at_rest else -KEEP_1_S * now.deviation
            if self.command.give_way_n is not None:
                rate = rate + self._yielding(along, YIELD_FROM_N if at_rest else self.command.give_way_n)
        now.aside = now.aside + tick_s * rate
        now.aside *= min(1.0, ASIDE_M / max(float(np.linalg.norm(now.aside)), 1e-9))

    def _yielding(self, along: np.ndarray, from_n: float) -> np.ndarray:
        """Velocity (3,) with which the hand gives way to what pushes it sideways with more than ``from_n``."""
        force = self.now.force - self.held
        force = force - (force @ along) * along
        size_n = float(np.linalg.norm(force))
        return np.asarray(-YIELD_M_NS * force * max(0.0, 1.0 - from_n / max(size_n, 1e-9)))

    def _row(self, place_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Posture, its change a metre, torques of 1 N and joint changes of 1 m, at a place of the path."""
        at = (place_m - self.first_m) / self.row_m
        k = min(max(int(at), 0), len(self.upper) - 2)
        share, slope = at - k, self.upper[k + 1] - self.upper[k]
        near = k if share < 0.5 else k + 1
        return self.upper[k] + share * slope, slope / self.row_m, self.push[near], self.aside[near]

    def tick(self) -> Tick:
        """The table's posture at the reference's place, eased in from the posture at the start."""
        now = self.now
        posture, slope, push, aside = self._row(now.place_m)
        self._sway(posture)
        posture = posture + (now.aside + now.bent - now.sway) @ aside
        ease = 1.0 - smooth(now.ticks * self.arm.body.tick_s / EASE_S)
        if ease > 0.0:
            posture = posture + ease * self.offset
        stance = self.row.copy()
        stance[law.ZMP : law.ZMP + 2] += self._lean()
        if self.command.braced:
            stance[law.YAW_RATE] += self._twist()
        along = self._direction()
        force = now.push_n * along + self.held - (self.held @ along) * along
        torque = (1.0 - ease) * (force @ push) + ease * self.torque
        return Tick(posture, slope * now.velocity_m_s, torque, self.jaws, stance)

    def _sway(self, posture: np.ndarray) -> None:
        """Hips and soles give way to the hand's push: a light robot turns by 12 degrees under 18 N."""
        now, arm = self.now, self.arm
        q = arm.measured()
        q[arm.upper] = posture
        planned = moved(self.way.affordance, self.sign * now.place_m / self.unit_m, self.way.start)
        change = arm.kinematics.tool_place(q, arm.side) - planned - now.sway
        now.sway = now.sway + change * min(1.0, arm.body.tick_s / self.lean_s)
        now.sway *= min(1.0, ASIDE_M / max(float(np.linalg.norm(now.sway)), 1e-9))

    def _lean(self) -> np.ndarray:
        """How far the ZMP must move (2,) [m], so that the centre of mass stays; see ``follow.zmp_shifts``."""
        force, body = self.now.slow, self.arm.body
        com = body.stand[law.XI : law.XI + 2]
        place = self.arm.tool()
        height_m = place[2] - body.ground_z_m()
        weight_n = self.arm.kinematics.mass_kg * GRAVITY_M_S2
        return np.asarray(-(height_m * force[:2] - (place[:2] - com) * force[2]) / weight_n)

    def _twist(self) -> float:
        """Rate of heading [rad/s] to ask for, so that the hand's push does not turn the body.

        The law makes of it an acceleration, ``rotation_damping`` times the rate; the push's moment about the centre of
        mass needs (r - c) x F / I. Without it a light robot gives way: its pull back to its heading is limited. Of the
        felt force nothing is fed back: with a hand on something fixed that is a loop of positive gain.
        """
        force, body = self.now.push_n * self._direction(), self.arm.body
        x, y = self.arm.tool()[:2] - body.stand[law.XI : law.XI + 2]
        turning = float(x * force[1] - y * force[0]) / self.spin_kg_m2
        return clamp(turning, -TWIST_RAD_S2, TWIST_RAD_S2) / body.rotation_damping


def body_torque(arm: Arm) -> np.ndarray:
    """Torques (n_upper,) that have held what the hand presses on."""
    torque = arm.body.torque
    return np.zeros(len(arm.body.upper_names)) if torque is None else torque


def hand_weight_n(arm: Arm) -> float:
    """What the wrist carries: everything beyond the arm's last joint, and the hand's jaws."""
    kinematics = arm.kinematics
    data = kinematics.model.createData()
    pin.computeSubtreeMasses(kinematics.model, data)
    return float(data.mass[kinematics.carriers[palm_of(arm)]]) * GRAVITY_M_S2


def spin_inertia(arm: Arm) -> float:
    """Of the whole robot as it stands, about the vertical through its centre of mass [kg m^2]."""
    kinematics = arm.kinematics
    data = kinematics.model.createData()
    pin.ccrba(kinematics.model, data, arm.measured(), np.zeros(kinematics.model.nv))
    return float(data.Ig.inertia[2, 2])


def palm_of(arm: Arm) -> str:
    """The link that carries the hand: its force-torque sensor sits at the joint that moves it."""
    return next(mount.palm for mount in arm.body.spec.model.hands if mount.side == arm.side)
