"""Turn the head, take a named posture."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Look, Posture
from teleop_sim.robot.gait import smooth
from teleop_sim.robot.skill import Done, Motion, Tick


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
    """Turn the head; each pitch joint takes what the other cannot (both are one-sided)."""
    goal = body.posture.copy()
    lower, upper = command_pitch(body, command.pitch_rad)
    for name, value in zip((*body.spec.head_pitch, body.spec.head_yaw), (lower, upper, command.yaw_rad), strict=True):
        goal[body.upper_names.index(name)] = _within(body, name, value)
    yield from blend(body, goal, command.duration_s)
    return Done("reached")


def command_pitch(body: Body, pitch_rad: float) -> tuple[float, float]:
    """Lower and upper neck pitch for a camera pitch (down positive) relative to the torso."""
    frame = next(f for f in body.spec.model.description.frames if f.name == body.spec.camera_frame)
    wanted = pitch_rad - frame.rpy_rad[1]
    lower = _within(body, body.spec.head_pitch[0], wanted)
    return lower, _within(body, body.spec.head_pitch[1], wanted - lower)


def _within(body: Body, name: str, value: float) -> float:
    joint = body.spec.model.description.joint(name)
    return min(max(value, joint.lower_rad + 0.01), joint.upper_rad - 0.01)


def posture(body: Body, command: Posture, _: np.random.Generator) -> Motion:
    """Take a named posture with open hands; the head stays where it looks."""
    goal = body.named_posture(command.name)
    for name in body.spec.neck:
        goal[body.upper_names.index(name)] = body.posture[body.upper_names.index(name)]
    if np.abs(goal - body.posture).max() < 1e-3 and body.jaws == (0.0, 0.0):
        return Done("reached")
    yield from blend(body, goal, command.duration_s, (0.0, 0.0))
    return Done("reached")
