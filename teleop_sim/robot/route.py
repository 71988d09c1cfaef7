"""Round what stands in the way: footsteps of a walk, from what the LIDAR has seen and the room that the robot needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from teleop_sim.robot import gait as g
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Cloud, PlanarPose
from teleop_sim.robot.footstep_planner import BUDGET, HARD_BUDGET, MARGIN_M, Outline, plan_footsteps
from teleop_sim.robot.gait import Footstep, Gait
from teleop_sim.robot.occupancy import CELL_M, Occupancy, occupancy, widened
from teleop_sim.robot.perception.rays import Bools, Floats

LIMB_M: Final = 0.08  # assumed: half of what a limb is thick, and hand and sway
COVER_M: Final = 0.12  # assumed: discs stand for links within this distance
CLEARANCES_M: Final = (0.1, 0.05, 0.0)
"""Wished for beyond the outline; kept at least (assumed)."""
LOOK_EVERY_M: Final = 0.1
"""A walk without planning is checked so often (assumed)."""


def outline_of(body: Body) -> Outline:
    """The room that a robot needs as it holds itself now."""
    model, data, spec = body.plant.model, body.plant.data, body.spec
    x, y, yaw = g.body_between(body.feet())
    links = np.flatnonzero(model.body_rootid == model.body_rootid[1])
    places = data.xpos[links]
    joints = [name for names in spec.arms.values() for name in names]
    joints += [f"{mount.side}{mount.hand.parts[0].name}" for mount in spec.model.hands]
    arms = [int(model.joint(name).bodyid[0]) for name in joints]
    split_m = float(data.xpos[arms, 2].min()) - LIMB_M
    c, s = math.cos(yaw), math.sin(yaw)
    upper = places[places[:, 2] >= split_m][:, :2] - (x, y)
    length, width = spec.model.description.sole.size_m[:2]
    return Outline(
        sole_m=(float(length), float(width)),
        legs_m=spec.gait.width_m / 2 + math.hypot(length, width) / 2,
        arms=_cover(upper @ np.array([[c, -s], [s, c]])),
        arms_m=COVER_M + LIMB_M,
        split_m=split_m,
    )


def _cover(places: Floats) -> tuple[tuple[float, float], ...]:
    """Some of the places (n, 2), so that each is within 12 cm of one: farthest first."""
    away = np.hypot(*places.T)
    chosen: list[tuple[float, float]] = []
    while away.max() > (COVER_M if chosen else -1.0):
        x, y = places[int(np.argmax(away))]
        chosen.append((float(x), float(y)))
        off = np.hypot(places[:, 0] - x, places[:, 1] - y)
        away = np.minimum(away, off) if len(chosen) > 1 else off
    return tuple(chosen)


def steps_round(
    body: Body, here: PlanarPose, path: Sequence[PlanarPose], clouds: Sequence[Cloud]
) -> tuple[Footstep, ...] | None:
    """Footsteps along a path, or, where something is in its way, to its end as short as may be; None: no way is
    known.
    """
    gait, outline = body.spec.gait, outline_of(body)
    seen = survey(here, path, clouds, outline)
    bodies = g.walk_bodies(here, path, gait)
    if is_clear(seen, (here, *bodies), outline, gait):
        return plain_steps(here, bodies, gait)
    for budget in (BUDGET, HARD_BUDGET):
        for clearance_m in CLEARANCES_M:
            plan = plan_footsteps(seen, here, path[-1], gait, outline, clearance_m, budget)
            if plan.why == "ok":
                return plan.steps
    return None


def plain_steps(here: PlanarPose, bodies: Sequence[PlanarPose], gait: Gait) -> tuple[Footstep, ...]:
    """Footsteps under body poses, led by the inner foot of the first turn."""
    turn = g.wrap(bodies[0][2] - here[2]) if bodies else 0.0
    return g.steps_along(bodies, g.first_foot(turn), gait)


def survey(here: PlanarPose, path: Sequence[PlanarPose], clouds: Sequence[Cloud], outline: Outline) -> Occupancy:
    """The occupancy of all ground that a walk may come to."""
    places = np.array([pose[:2] for pose in (here, *path)])
    low, high = places.min(axis=0), places.max(axis=0)
    x, y = (low + high) / 2
    # The lattice is turned against the grid.
    half_m = float(np.hypot(*(high - low))) / 2 + (MARGIN_M + 0.3) * math.sqrt(2.0)
    return occupancy(clouds, (float(x), float(y)), half_m, outline.split_m, (here,))


def is_clear(seen: Occupancy, bodies: Sequence[PlanarPose], outline: Outline, gait: Gait) -> bool:
    """Whether a robot that goes through body poses comes neither to something that was seen nor off an edge."""
    poses = _between(bodies)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])

    def hit(mask: Bools, ahead_m: float, left_m: float) -> bool:
        xy = poses[:, :2] + np.stack([c * ahead_m - s * left_m, s * ahead_m + c * left_m], axis=-1)
        index = np.clip(seen.grid.index(xy), 0, seen.grid.count - 1)
        return bool(mask[index[:, 0], index[:, 1]].any())

    legs = widened(seen.legs | seen.arms, outline.legs_m / CELL_M)
    arms = widened(seen.arms, outline.arms_m / CELL_M)
    drop = widened(seen.drop, outline.sole_m[1] / 2 / CELL_M)
    half_m = gait.width_m / 2
    return not (
        hit(legs, 0.0, 0.0)
        or any(hit(arms, x, y) for x, y in outline.arms)
        or any(hit(drop, 0.0, side * half_m) for side in (-1, 1))
    )


def _between(bodies: Sequence[PlanarPose]) -> Floats:
    """Poses (n, 3), no two farther apart than 0.1 m and 0.2 rad."""
    poses = [bodies[0]]
    for x1, y1, yaw1 in bodies[1:]:
        x0, y0, yaw0 = poses[-1]
        turn = g.wrap(yaw1 - yaw0)
        n = max(1, math.ceil(max(math.hypot(x1 - x0, y1 - y0) / LOOK_EVERY_M, abs(turn) / 0.2)))
        poses += [(x0 + (x1 - x0) * k / n, y0 + (y1 - y0) * k / n, yaw0 + turn * k / n) for k in range(1, n + 1)]
    return np.array(poses)
