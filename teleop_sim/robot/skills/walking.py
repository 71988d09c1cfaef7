"""Walk, step and stop."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot import gait as g
from teleop_sim.robot import law
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Step, Stop, Walk
from teleop_sim.robot.gait import Footstep, Plan
from teleop_sim.robot.skill import Done, Motion, Tick

LEFTOVER_S = 3.0
"""Time given to a body stopped in mid-step to come to rest."""


def walk(body: Body, command: Walk, _: np.random.Generator) -> Motion:
    """Walk along the path. Ends ``reached``, with the error to the goal in metres as data."""
    here = g.body_between(body.feet())
    bodies = g.walk_bodies(here, command.path, body.spec.gait)
    turn = g.wrap(bodies[0][2] - here[2]) if bodies else 0.0
    yield from _follow_plan(body, g.steps_along(bodies, g.first_foot(turn), body.spec.gait))
    x, y, _yaw = g.body_between(body.feet())
    return Done("reached", data=float(np.hypot(x - command.path[-1][0], y - command.path[-1][1])))


def step(body: Body, command: Step, _: np.random.Generator) -> Motion:
    """Move the stance in the robot's own frame, then turn on the spot."""
    gait = body.spec.gait
    here = g.body_between(body.feet())
    if abs(command.forward_m) + abs(command.left_m) > 1e-6:
        bodies = g.shift_bodies(here, command.forward_m, command.left_m, gait)
        first = g.first_foot(0.0, command.left_m)
        yield from _follow_plan(body, g.steps_along(bodies, first, gait))
    if abs(command.turn_rad) > 1e-6:
        bodies = g.turn_bodies(g.body_between(body.feet()), command.turn_rad, gait)
        yield from _follow_plan(body, g.steps_along(bodies, g.first_foot(command.turn_rad), gait))
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
    for k in range(len(plan.rows)):
        # A cut leaves the rest of the plan in the state, so that a stop can finish the step under way.
        body.walking = (plan, k)
        yield Tick(body.posture, jaws=body.jaws, row=plan.rows[k])
    body.walking = None
    return Done("reached")


def stop(body: Body, _command: Stop, _: np.random.Generator) -> Motion:
    """Finish the step under way, then stand on the feet as they are."""
    left = body.unfinished
    if left is not None:
        rows = np.frombuffer(left.rows).reshape(-1, law.COLUMNS)
        for row in rows[: left.step_ends[0] if left.step_ends else len(rows)]:
            yield Tick(body.posture, jaws=body.jaws, row=row)
        body.set_stand()
    for _k in range(round(LEFTOVER_S / body.tick_s)):
        if body.speed() < 0.01:
            break
        yield Tick(body.posture, jaws=body.jaws)
    return Done("stopped")
