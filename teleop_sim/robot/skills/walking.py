"""Walk, step and stop."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot import gait as g
from teleop_sim.robot import law
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import PlanarPose, Step, Stop, Walk
from teleop_sim.robot.gait import Footstep, Plan
from teleop_sim.robot.route import plain_steps, steps_round
from teleop_sim.robot.skill import Done, Motion, Tick

ARRIVED_M = 0.02
ARRIVED_RAD = 0.035
"""A walk that ends further off takes a step with each foot to put it right: feet slip, above all in turns (assumed)."""

CORRECTIONS = 2
"""How often at most (assumed)."""

LEFTOVER_S = 3.0
"""Time given to a body stopped in mid-step to come to rest."""

STAGGER_M = 0.1
STAGGER_RAD = 0.2
"""Feet further than this from side by side are squared before a walk (assumed; walks end within 2 cm and 0.02 rad)."""


def walk(body: Body, command: Walk, _: np.random.Generator) -> Motion:
    """Walk along the path. Ends ``reached``, with the error to the goal in metres as data, or ``no_plan``."""
    yield from _square(body)
    here = g.body_between(body.feet())
    steps = steps_to(body, here, command)
    if steps is None:
        return Done("no_plan", "something stands in the way, and no way round it is known")
    yield from _follow_plan(body, steps)
    yield from _put_right(body, command.path[-1])
    x, y, _yaw = g.body_between(body.feet())
    return Done("reached", data=float(np.hypot(x - command.path[-1][0], y - command.path[-1][1])))


def steps_to(body: Body, here: PlanarPose, command: Walk) -> tuple[Footstep, ...] | None:
    """Footsteps of a walk; None where what was seen leaves no way."""
    if command.clouds:
        return steps_round(body, here, command.path, command.clouds)
    return plain_steps(here, g.walk_bodies(here, command.path, body.spec.gait), body.spec.gait)


def _put_right(body: Body, goal: PlanarPose) -> Motion:
    """Step onto the goal from where the feet have really come to stand."""
    gait = body.spec.gait
    for _ in range(CORRECTIONS):
        x, y, yaw = g.body_between(body.feet())
        ahead, left, turn = goal[0] - x, goal[1] - y, g.wrap(goal[2] - yaw)
        if np.hypot(ahead, left) < ARRIVED_M and abs(turn) < ARRIVED_RAD:
            break
        aside = -np.sin(yaw) * ahead + np.cos(yaw) * left
        n = int(np.ceil(max(np.hypot(ahead, left) / gait.side_m, abs(turn) / gait.turn_rad)))
        bodies = [(x + ahead * k / n, y + left * k / n, yaw + turn * k / n) for k in range(1, n + 1) for _ in (0, 1)]
        # Led by the foot on the side of the larger of both moves, a step being as long as the robot is wide.
        first = g.first_foot(turn, float(aside) / gait.width_m)
        yield from _follow_plan(body, g.steps_along(bodies, first, gait))
    return Done("reached")


def step(body: Body, command: Step, _: np.random.Generator) -> Motion:
    """Move the stance in the robot's own frame, then turn on the spot; a small turn is made on the way."""
    gait = body.spec.gait
    yield from _square(body)
    here = g.body_between(body.feet())
    with_shift = command.turn_rad if abs(command.turn_rad) <= gait.turn_walking_rad else 0.0
    shift = g.shift_bodies(here, command.forward_m, command.left_m, gait, with_shift)
    if shift:
        yield from _follow_plan(body, g.steps_along(shift, g.first_foot(0.0, command.left_m), gait))
    if not shift or not with_shift:
        turn = g.turn_bodies(g.body_between(body.feet()), command.turn_rad, gait)
        yield from _follow_plan(body, g.steps_along(turn, g.first_foot(command.turn_rad), gait))
    return Done("reached")


def _square(body: Body) -> Motion:
    """Bring the foot behind beside the other, if a stop has left a stride or a turn between them.

    A first stride from there can be twice as long as the gait allows: one of 40 walks after a stop fell (measured).
    """
    feet, width_m = body.feet(), body.spec.gait.width_m
    x, y, yaw = g.body_between(feet)
    ahead = [np.cos(yaw) * (foot[0] - x) + np.sin(yaw) * (foot[1] - y) for foot in feet]
    lead = int(np.argmax(ahead))
    # The body over the foot in front, and from there the place of the other.
    over = g.sole_place(feet[lead], 1 - lead, width_m)
    beside = g.sole_place((over.x, over.y, over.yaw), 1 - lead, width_m)
    behind = feet[1 - lead]
    far_m = np.hypot(behind[0] - beside.x, behind[1] - beside.y)
    if far_m > STAGGER_M or abs(g.wrap(behind[2] - beside.yaw)) > STAGGER_RAD:
        yield from _follow_plan(body, (beside,))
    return Done("reached")


def _follow_plan(body: Body, steps: tuple[Footstep, ...]) -> Motion:
    if not steps:
        return Done("reached")
    com = body.com()
    plan = g.make_plan(body.feet(), com[:2], body.com_height_m, 0.0, steps, body.spec.gait, body.tick_s)
    yield from _rows(body, plan)
    body.set_stand()
    return Done("reached")


def _rows(body: Body, plan: Plan) -> Motion:
    for k, row in enumerate(plan.rows):
        # A cut leaves the rest of the plan in the state, so that a stop can finish the step under way.
        body.walking = (plan, k)
        yield Tick(body.posture, jaws=body.jaws, row=row)
    body.walking = None
    return Done("reached")


def stop(body: Body, _command: Stop, _: np.random.Generator) -> Motion:
    """Finish the step under way, then stand on the feet as they are."""
    left = body.unfinished
    if left is not None:
        # A copy: of bytes it would be read-only, another type to compiled code.
        rows = np.frombuffer(left.rows).reshape(-1, law.COLUMNS).copy()
        for row in rows[: left.step_ends[0] if left.step_ends else len(rows)]:
            yield Tick(body.posture, jaws=body.jaws, row=row)
        body.set_stand()
    for _k in range(round(LEFTOVER_S / body.tick_s)):
        if body.speed() < 0.01:
            break
        yield Tick(body.posture, jaws=body.jaws)
    return Done("stopped")
