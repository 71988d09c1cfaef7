"""Insert: bring the tip of a held thing to a hole, feel for it in a spiral, push it in, make sure, let go.

Blind search as in Chhatpar and Branicky, IROS 2001, 1465-1470: the tip is pressed lightly on the surface and moved
along an Archimedean spiral until it drops. What is felt: the hand's pose by the joints, the force at the wrist. The
force along the axis is held by admittance: the reference advances in proportion to the force that is missing.

Not modelled: that the thing may be turned in the hand (it is taken as it was gripped); holes that ask for a turn.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Handle, Insert
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.holding import draw_back, has_it, kept_posture, let_go, refusal, strayed
from teleop_sim.robot.skills.manipulate import arm_of
from teleop_sim.robot.skills.servoing import UP, Led, line

OVER_M = 0.05
"""Tip over the mouth before going down (assumed)."""
FIRM_N, PUSH_N, LIMIT_N = 12.0, 40.0, 60.0
"""Along the axis: while searching, while pushing in, and what ends the push (assumed)."""
ADVANCE_M_S = 0.02
SOFT_M_SN = 1.0e-3
"""Admittance: rate of advance for each newton that is missing (measured: 2 kN/m of arm, 0.2 s of averaging)."""
LEAD_M = 0.03
"""How far the reference may be ahead of the felt tip along the axis; the leash of the joints holds as well."""
TURN_M = 0.005
"""Between two turns of the spiral: less than the funnel's width (assumed)."""
SEARCH_M_S = 0.015
DROP_M = 0.006
"""So far below where it first touched, the tip is in the hole (assumed)."""
STUCK_S = 3.0
PUSHES = 5
"""How often at most the tip is pushed at what seems to be the hole (assumed)."""
WRIGGLE_M, WRIGGLE_HZ = 0.003, 1.0
"""Small circle while pushing, so that a tilted peg does not stay jammed (assumed)."""
SHORT_M = 0.008
"""Inserted is, whose tip is felt less than so much short of the depth (assumed: errors of joints and grip)."""
TUG_M, TUG_S, TUG_N = 0.03, 1.0, 5.0
"""A tip in a hole resists being moved aside, either way; one beside it does not (assumed: more than the 17 mm of play
in a hole and between two jaws that press alike)."""
LIMIT_S = 60.0


@dataclass(frozen=True)
class InsertReport:
    """Depth of the tip below the believed mouth [m], most force along the axis [N], way of the search [m], and how
    far aside from the believed mouth the tip ended [m].
    """

    depth_m: float
    force_n: float
    searched_m: float
    aside_m: float


class _Probe:
    """A tip on its way into a hole, seen along the axis. Scratch.

    Attributes:
        along_m: reference of the tip beyond the mouth. most_n: most force along the axis. searched_m: way of the
            search. rim_m: depth at which the tip first touched; NaN if it has not. angle_rad: along the spiral.
    """

    def __init__(self, led: Led, command: Insert, rotation: np.ndarray) -> None:
        self.led, self.rotation = led, rotation
        self.axis = np.array(command.axis) / np.linalg.norm(command.axis)
        self.mouth = np.array(command.mouth)
        self.tip_m = command.tip_m
        self.along_m = -OVER_M
        self.most_n = 0.0
        self.searched_m = 0.0
        self.rim_m = math.nan
        self.angle_rad = 0.0
        weight = led.told_kg * 9.81
        self._borne_n = -weight * float(UP @ self.axis)

    def tip(self) -> np.ndarray:
        """Where the tip is felt to be, from the believed mouth (3,) [m]."""
        rotation, position = self.led.arm.hand()
        tip: np.ndarray = position + self.tip_m * rotation[:, 2] - self.mouth
        return tip

    def depth_m(self) -> float:
        """How far the tip is beyond the believed mouth."""
        return float(self.tip() @ self.axis)

    def press_n(self) -> float:
        """Force with which the tip presses along the axis."""
        return float(self.led.force() @ self.axis) + self._borne_n

    def aside_m(self) -> np.ndarray:
        """Part of ``tip`` across the axis (3,) [m]."""
        tip = self.tip()
        return np.asarray(tip - self.axis * float(tip @ self.axis))

    def press(self, wanted_n: float, aside: np.ndarray) -> Tick:
        """Lead the tip to ``aside`` (3,) [m] of the mouth's axis, pressing with a force; advance until it is felt."""
        press_n = self.press_n()
        self.most_n = max(self.most_n, press_n)
        rate = min(max(SOFT_M_SN * (wanted_n - press_n), -ADVANCE_M_S), ADVANCE_M_S)
        felt_m = self.depth_m()
        dt = self.led.arm.body.tick_s
        self.along_m = min(max(self.along_m + rate * dt, felt_m - LEAD_M), felt_m + LEAD_M)
        place = self.mouth + aside + (self.along_m - self.tip_m) * self.axis
        return self.led.towards(place, self.rotation)


def insert(body: Body, command: Insert, rng: np.random.Generator) -> Motion:
    """See ``Insert``; data: ``InsertReport`` once the tip has come to the mouth."""
    arm = arm_of(body, command.side)
    led = Led(arm)
    mass_kg = led.told_kg
    axis = np.array(command.axis) / np.linalg.norm(command.axis)
    # Reachable must be the bottom; the way down to it is then short and straight.
    held = np.array(command.mouth) + (command.depth_m - command.tip_m) * axis
    x, y, z = (float(v) for v in held)
    target, posed = kept_posture(arm, Handle((x, y, z), command.axis, None, mass_kg), rng)
    why = refusal(posed, "the hole")
    if why is not None:
        return Done("no_plan", why)
    over = target.position - (OVER_M + command.depth_m) * axis
    yield from _come_over(led, over, target.rotation, posed.solution.q)
    why = strayed(led, over, target.rotation)
    if why is not None:
        return Done("no_plan", why)
    if mass_kg > 0 and not has_it(led, mass_kg):
        led.tell(0.0)
        return Done("lost", f"only {led.weight_n:.1f} N at the wrist over the hole")
    probe = _Probe(led, command, target.rotation)
    outcome = yield from _feel_for(probe, command)
    for attempt in range(PUSHES):
        if outcome != "found":
            break
        outcome = yield from _push(probe, command)
        # Stuck on the rim: what gave way was no hole. The search goes on from there.
        if outcome == "force_limit" and probe.depth_m() < probe.rim_m + 2 * DROP_M and attempt + 1 < PUSHES:
            probe.rim_m = math.nan
            outcome = yield from _feel_for(probe, command)
    report = InsertReport(probe.depth_m(), probe.most_n, probe.searched_m, float(np.linalg.norm(probe.aside_m())))
    words = f"tip {report.depth_m * 1e3:.0f} mm in, {report.aside_m * 1e3:.0f} mm aside, {report.force_n:.0f} N at most"
    if outcome != "inserted":
        yield from line(led, arm.hand()[1] - 0.08 * axis, target.rotation, 1.5)
        return Done(outcome, words, report)
    yield from let_go(led)
    yield from draw_back(led)
    return Done("inserted", words, report)


def _come_over(led: Led, place: np.ndarray, rotation: np.ndarray, goal: np.ndarray) -> Generator[Tick, None, None]:
    """Up to the height first, then across: what hangs in the hand must not sweep things along."""
    now, here = led.arm.hand()
    rise_m = float(place[2] - here[2])
    if rise_m > 0.0:
        yield from line(led, here + rise_m * UP, now, max(0.8, rise_m / 0.1), settle_s=0.0)
        here = here + rise_m * UP
    led.goal = goal
    across = place + max(0.0, -rise_m) * UP
    length_m = float(np.linalg.norm(across - here))
    yield from line(led, across, rotation, max(1.5, length_m / 0.1), settle_s=0.2)
    yield from line(led, place, rotation, max(0.8, -rise_m / 0.1), settle_s=0.6)


def _feel_for(probe: _Probe, command: Insert) -> Generator[Tick, None, str]:
    """Press and search until the tip drops: ``found`` or ``not_found``."""
    across = _across(probe.axis)
    ticks = 0
    dt = probe.led.arm.body.tick_s
    while ticks * dt < LIMIT_S:
        ticks += 1
        radius_m = TURN_M * probe.angle_rad / math.tau
        if radius_m > command.search_m:
            return "not_found"
        aside = radius_m * (math.cos(probe.angle_rad) * across[0] + math.sin(probe.angle_rad) * across[1])
        yield probe.press(FIRM_N, aside)
        depth_m = probe.depth_m()
        if depth_m > command.search_m + DROP_M or depth_m > probe.rim_m + DROP_M:
            return "found"
        if math.isnan(probe.rim_m):
            probe.rim_m = depth_m if probe.press_n() > 0.7 * FIRM_N else math.nan
            continue
        probe.rim_m = min(probe.rim_m, depth_m) if probe.press_n() > 0.5 * FIRM_N else probe.rim_m
        step_m = SEARCH_M_S * dt
        probe.angle_rad += step_m / max(radius_m, TURN_M / 2)
        probe.searched_m += step_m
    return "not_found"


def _push(probe: _Probe, command: Insert) -> Generator[Tick, None, str]:
    """Push down the hole, giving way aside; then tug: ``inserted``, ``force_limit`` or ``not_found``."""
    best_m, since_s, dt = probe.depth_m(), 0.0, probe.led.arm.body.tick_s
    across, angle = _across(probe.axis), 0.0
    # Where the rim was felt, depth counts from there; else the mouth may be as far off as the search was to go.
    goal_m, short_m = probe.rim_m + command.depth_m, SHORT_M
    if math.isnan(goal_m):
        goal_m, short_m = command.depth_m + command.search_m, SHORT_M + 2 * command.search_m
    while probe.depth_m() < goal_m and since_s < STUCK_S and probe.press_n() < LIMIT_N:
        wriggle = WRIGGLE_M * (math.cos(angle) * across[0] + math.sin(angle) * across[1])
        angle += math.tau * WRIGGLE_HZ * dt
        yield probe.press(PUSH_N, probe.aside_m() + wriggle)
        since_s = 0.0 if probe.depth_m() > best_m + 1e-3 else since_s + dt
        best_m = max(best_m, probe.depth_m())
    if best_m < goal_m - short_m:
        return "force_limit"
    start = probe.aside_m()
    for direction in (across[0], -across[0], across[1], -across[1]):
        resists = yield from _tug(probe, start, direction)
        # Beside the hole nothing holds the tip.
        if not resists:
            return "not_found"
    return "inserted"


def _tug(probe: _Probe, start: np.ndarray, direction: np.ndarray) -> Generator[Tick, None, bool]:
    """Lead the tip aside, and wait there, until something holds it, and back; return whether anything did."""
    count, far = round(TUG_S / probe.led.arm.body.tick_s), 0
    held = False
    while far < 2 * count and not held:
        far += 1
        yield probe.press(FIRM_N, start + min(1.0, far / count) * TUG_M * direction)
        held = float(probe.led.force() @ direction) > TUG_N
    for k in range(min(far, count), -1, -1):
        yield probe.press(FIRM_N, start + k / count * TUG_M * direction)
    return held


def _across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (3,) across an axis and each other."""
    other = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else UP
    first = np.cross(axis, other)
    first = first / np.linalg.norm(first)
    return first, np.cross(axis, first)
