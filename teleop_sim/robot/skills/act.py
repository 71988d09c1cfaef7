"""Act: move what the hand holds along a line, round an axis or along a screw, as far as it was told.

What closes the loop is measured: the place of the hand (or of the tool in it), and the force at the wrist. The thing is
known by these alone. See ``teleop_sim.robot.skills.acting`` for the loop.

Not modelled: shapes round the thing and the held tool, when the way is checked for collisions (the robot itself is).
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from teleop_sim.robot.affordance import within
from teleop_sim.robot.affordance_table import MotionTable, Way, motion_table, with_tool
from teleop_sim.robot.body import Body
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.commands import Act
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.acting import DONE_M, Actor
from teleop_sim.robot.skills.manipulate import Arm, arm_of, plan_stance, rest_posture

RELAX_S = 0.6
"""For the hand to lose its load (assumed: as cranking's)."""

CAUSES = {
    "reached": "the thing has been moved as far as asked",
    "force_limit": "the wrist's force came to its limit",
    "no_motion": "the thing does not move",
    "grip_lost": "the hand lost touch with the thing or left its path",
    "timed_out": "time limit",
}


@dataclass(frozen=True)
class ActReport:
    """What the robot knows at the end.

    Attributes:
        amount: how far the thing was felt to go, in the affordance's unit.
        reach: how far the arm could have taken it, of what was asked, without letting go.
        peak_n: the greatest force at the wrist.
        resisted_n: the force along the path at the end of the motion.
        aside_m: how far the hand was led off the believed path, at most.
        stage: ``arm`` or ``chain``, the joints that moved.

    """

    amount: float
    reach: float
    peak_n: float
    resisted_n: float
    aside_m: float
    stage: str


def act(body: Body, command: Act, rng: np.random.Generator) -> Motion:
    """Move a held thing. Ends as ``Act`` says; data: ``ActReport`` (None beyond the affordance's extent).

    The posture table is planned from where the hand is felt to be. An amount out of reach ends ``no_plan`` and says
    how much of it is in reach: ``affordance.strokes`` cuts it.
    """
    if not within(command.affordance, command.amount):
        low, high = command.affordance.extent
        return Done("no_plan", f"the thing goes from {low} to {high} {command.affordance.unit}")
    arm = arm_of(body, command.side)
    if command.usability is not None:
        arm = replace(arm, kinematics=with_tool(arm.kinematics, arm.side, command.usability))
    way, table = _planned(arm, command)
    refusal = _refusal(arm, way, table)
    if refusal:
        return Done("no_plan", refusal, ActReport(0.0, table.reach, 0.0, 0.0, 0.0, table.stage))
    actor = Actor(arm, command, table, way)
    outcome = yield from _until_there(actor)
    resisted_n = actor.now.push_n
    for _ in range(round(RELAX_S / body.tick_s)):
        actor.sense()
        last = actor.relax()
        yield last
    now = actor.now
    report = ActReport(now.amount, table.reach, now.peak_n, resisted_n, now.off_m, table.stage)
    told = f"{CAUSES[outcome]}; {report.amount:.3f} of {command.amount:.3f} {command.affordance.unit}"
    felt = f"{told}, {report.peak_n:.0f} N at most"
    return Done(outcome, felt, report, torque=last.torque)


def _planned(arm: Arm, command: Act) -> tuple[Way, MotionTable]:
    """The way from where the hand or its tool is felt to be, and postures along it."""
    rotation, position = arm.hand()
    spin = rotation if command.rigid else None
    way = Way(command.affordance, command.amount, position, rotation[:, 2], spin)
    now, stance = plan_stance(arm)
    return way, motion_table(arm.kinematics, arm.side, stance, rest_posture(arm, stance), now, way)


def _refusal(arm: Arm, way: Way, table: MotionTable) -> str:
    """Why a table will not do, or nothing."""
    if not table.usable:
        return f"out of reach beyond {table.reach:.3f} {way.affordance.unit}"
    shares = table.amounts / way.amount if way.amount else np.zeros(len(table.amounts))
    asked = table.q[(shares > -1e-9) & (shares < 1.0 + 1e-9)]
    touches = Collisions(arm.robot, ()).along(list(asked), 0.0)
    return "" if touches is None else "{} would touch {}".format(*touches)


def _until_there(actor: Actor) -> Generator[Tick, None, str]:
    while True:
        ended = actor.sense()
        if ended:
            return ended
        if abs(actor.missing_m()) <= DONE_M:
            return "reached"
        yield actor.advance()
