"""Turn the head, take a named posture."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Look, Posture
from teleop_sim.robot.gait import smooth
from teleop_sim.robot.predefined import angles_of
from teleop_sim.robot.skill import Done, Motion, Tick
from teleop_sim.robot.skills.joints import swing


def blend(body: Body, goal: np.ndarray, duration_s: float, jaws: tuple[float, float] | None = None) -> Motion:
    """Move the upper body's reference to ``goal`` (n_upper,) with zero speed at both ends."""
    start = body.posture.copy()
    n = max(1, round(duration_s / body.tick_s))
    before = 0.0
    for k in range(1, n + 1):
        u = float(smooth(np.array(k / n)))
        rate = (goal - start) * (u - before) / body.tick_s
        before = u
        yield Tick(start + (goal - start) * u, rate=rate, jaws=body.jaws if jaws is None else jaws)
    return Done("reached")


def look(body: Body, command: Look, _: np.random.Generator) -> Motion:
    """Turn the head; each pitch joint takes what those below it cannot (Valkyrie's two are one-sided)."""
    goal = body.posture.copy()
    for name, value in command_head(body, command.pitch_rad, command.yaw_rad).items():
        goal[body.upper_names.index(name)] = value
    yield from blend(body, goal, command.duration_s)
    return Done("reached")


def command_head(body: Body, pitch_rad: float, yaw_rad: float) -> dict[str, float]:
    """Neck angles for a camera pitch (down positive) and yaw relative to the torso, as far as the neck goes."""
    spec = body.spec
    frame = next(f for f in spec.model.description.frames if f.name == spec.camera_frame)
    angles, rest = {}, pitch_rad - frame.rpy_rad[1]
    for name in spec.head_pitch:
        angles[name] = _within(body, name, rest)
        rest -= angles[name]
    if spec.head_yaw is not None:
        angles[spec.head_yaw] = _within(body, spec.head_yaw, yaw_rad)
    return angles


def _within(body: Body, name: str, value: float) -> float:
    joint = body.spec.model.description.joint(name)
    return min(max(value, joint.lower_rad + 0.01), joint.upper_rad - 0.01)


def posture(body: Body, command: Posture, _: np.random.Generator) -> Motion:
    """Take a named posture with open hands; the head stays where it looks.

    One of ``teleop_sim.robot.predefined`` moves its own joints alone, guarded, and may end ``blocked``; hands and all
    other joints stay as they are.
    """
    home = dict(zip(body.upper_names, body.named_posture("walk"), strict=True))
    angles = angles_of(body.spec, command.name, home)
    if angles is not None:
        return (yield from swing(body, angles, command.duration_s))
    goal = body.named_posture(command.name)
    for name in body.spec.neck:
        goal[body.upper_names.index(name)] = body.posture[body.upper_names.index(name)]
    if np.abs(goal - body.posture).max() < 1e-3 and body.jaws == (0.0, 0.0):
        return Done("reached")
    yield from blend(body, goal, command.duration_s, (0.0, 0.0))
    return Done("reached")
