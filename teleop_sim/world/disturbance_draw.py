"""Draw disturbances from ranges: what a scenario states is a range, what a run meets is a draw.

Each quantity has a stream of its own, of which all is drawn whatever its range is: a range that is changed, or a
disturbance that is added, moves no other draw.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import accumulate, pairwise

import numpy as np

from teleop_sim.core.errors import UnknownName
from teleop_sim.world.description import Vector
from teleop_sim.world.disturbance_ranges import (
    DisturbanceRanges,
    PayloadRanges,
    PlateRanges,
    PushRanges,
    Range,
    SenseRanges,
    Sized,
    Whole,
)
from teleop_sim.world.disturbances import PATCH_HEIGHT_M, Disturbances, Payload, Plate, Push
from teleop_sim.world.robot_model import RobotModel
from teleop_sim.world.sense_errors import Misalignment, SenseErrors

Way = tuple[tuple[float, float], ...]
"""Corners (x, y) [m] of a way, in order."""
Streams = Callable[[str], np.random.Generator]
"""Named random streams of one replicate."""

PUSHED_UP_TO_S = 300.0
"""Pushes are drawn for so much time of motion (assumed: longer than any task moves)."""


@dataclass(frozen=True, slots=True)
class Ground:
    """Where a robot is to walk, and the friction of the floor there."""

    way_m: Way
    friction: float


def draw_disturbances(streams: Streams, ranges: DisturbanceRanges, ground: Ground, robot: RobotModel) -> Disturbances:
    """Draw one run's disturbances.

    Args:
        streams: gives a random stream for a name. ranges: how much.
        ground: what bumps and patches lie on. robot: whose links and joints are meant.

    Raises:
        UnknownName: the robot has no such link for the payload.
    """

    def one(name: str, limits: Range) -> float:
        return _between(streams(f"disturbances.{name}").random(), limits)

    floor = None if ranges.floor_friction is None else one("floor", ranges.floor_friction)
    friction = ground.friction if floor is None else floor
    return Disturbances(
        floor_friction=floor,
        plates=(
            *_plates(streams, "bump", ranges.bumps, ground, friction),
            *_plates(streams, "patch", _thin(ranges.patches), ground, friction),
        ),
        pushes=_pushes(streams, ranges.pushes),
        payload=_payload(ranges.payload, robot, one),
        mass_factor=one("mass_factor", ranges.mass_factor),
        com_error_m=_vector(streams("disturbances.com_error_m"), ranges.com_error_m),
        joint_friction=one("joint_friction", ranges.joint_friction),
        strength=_strength(ranges, robot, one),
        delay_s=one("delay_s", ranges.delay_s),
        senses=_senses(streams, ranges.senses, one),
    )


def joints_like(robot: RobotModel, pattern: str) -> tuple[str, ...]:
    """Joints of a robot whose names a pattern fits."""
    return tuple(j.name for j in robot.description.joints if fnmatchcase(j.name, pattern))


def carriers(robot: RobotModel) -> dict[str, tuple[str, Vector]]:
    """What can carry a payload, by name: its link, and where on it [m]."""
    found = {link.name: (link.name, (0.0, 0.0, 0.0)) for link in robot.description.links}
    return found | {f"{mount.side}_hand": (mount.palm, _floats(mount.position_m)) for mount in robot.hands}


def _between(share: float, limits: Range) -> float:
    return limits[0] + float(share) * (limits[1] - limits[0])


def _whole(rng: np.random.Generator, limits: Whole) -> int:
    return int(_between(rng.random(), (limits[0], limits[1] + 1)))


def _floats(values: np.ndarray) -> Vector:
    x, y, z = values
    return float(x), float(y), float(z)


def _vector(rng: np.random.Generator, sized: Sized) -> Vector:
    """A vector of a drawn length in a drawn direction (a normalised Gaussian has no favourite one), or the given."""
    share, towards = rng.random(), rng.normal(size=3)
    if len(sized) == 3:
        return sized[0], sized[1], sized[2]
    length = _between(share, (sized[0], sized[1]))
    return _floats(length * towards / np.linalg.norm(towards))


# Ground and pushes ---------------------------------------------------------------------------------------------------


def _thin(ranges: PlateRanges | None) -> PlateRanges | None:
    """The same as patches."""
    return None if ranges is None else replace(ranges, height_m=(PATCH_HEIGHT_M, PATCH_HEIGHT_M))


def _plates(
    streams: Streams, kind: str, ranges: PlateRanges | None, ground: Ground, friction: float
) -> tuple[Plate, ...]:
    if ranges is None:
        return ()
    name = f"disturbances.{kind}"
    places, sizes = streams(name), streams(f"{name}.size")
    count = _whole(streams(f"{name}.count"), ranges.count or (1, 1))
    at: Sequence[tuple[float, float] | None] = ranges.at_m or count * (None,)
    plates = [_plate(places, sizes.random(4), ranges, ground.way_m, place, friction) for place in at]
    return tuple(plate for plate in plates if plate.height_m > 0)


def _plate(
    places: np.random.Generator,
    sizes: np.ndarray,
    ranges: PlateRanges,
    way_m: Way,
    place: tuple[float, float] | None,
    friction: float,
) -> Plate:
    along, askew = places.uniform(*ranges.along), places.uniform(*ranges.yaw_rad)
    x, y, heading = _on_way(way_m, along) if place is None else (*place, 0.0)
    return Plate(
        x,
        y,
        heading + float(askew),
        _between(sizes[0], ranges.length_m) / 2,
        _between(sizes[1], ranges.width_m) / 2,
        _between(sizes[2], ranges.height_m),
        friction if ranges.friction is None else _between(sizes[3], ranges.friction),
    )


def _on_way(corners: Way, share: float) -> Vector:
    """Place and heading on a way of straight pieces after a share of its length."""
    pieces = list(pairwise(corners))
    lengths = [float(np.hypot(b[0] - a[0], b[1] - a[1])) for a, b in pieces]
    ends = [reached / sum(lengths) for reached in accumulate(lengths, initial=0.0)]
    number = next((n for n in range(len(pieces)) if share <= ends[n + 1]), len(pieces) - 1)
    (x0, y0), (x1, y1) = pieces[number]
    t = float(share - ends[number]) / (ends[number + 1] - ends[number])
    return x0 + t * (x1 - x0), y0 + t * (y1 - y0), float(np.arctan2(y1 - y0, x1 - x0))


def _pushes(streams: Streams, ranges: PushRanges | None) -> tuple[Push, ...]:
    if ranges is None:
        return ()
    found = _endless_pushes(streams, ranges)
    most = None if ranges.count is None else _whole(streams("disturbances.pushes.count"), ranges.count)
    made: list[Push] = []
    for push in found:
        if push.start_s > PUSHED_UP_TO_S or len(made) == most:
            break
        made.append(push)
    return tuple(push for push in made if any(push.force_n) and push.duration_s > 0)


def _endless_pushes(streams: Streams, ranges: PushRanges) -> Iterator[Push]:
    when, how = streams("disturbances.pushes"), streams("disturbances.pushes.force")
    at_s = 0.0
    while True:
        pause, angle = when.uniform(*ranges.every_s), when.uniform(*ranges.direction_rad)
        force_n, lasts_s = _between(how.random(), ranges.force_n), _between(how.random(), ranges.duration_s)
        at_s += float(pause)
        yield Push(at_s, lasts_s, (float(force_n * np.cos(angle)), float(force_n * np.sin(angle)), 0.0))


# Robot ---------------------------------------------------------------------------------------------------------------


def _payload(ranges: PayloadRanges | None, robot: RobotModel, one: Callable[[str, Range], float]) -> Payload | None:
    if ranges is None:
        return None
    known = carriers(robot)
    if ranges.link not in known:
        raise UnknownName("disturbances.payload.link", ranges.link, tuple(known))
    link, at_m = known[ranges.link]
    mass_kg = one("payload.mass_kg", ranges.mass_kg)
    return Payload(link, mass_kg, ranges.at_m or at_m, known=ranges.known) if mass_kg > 0 else None


def _strength(ranges: DisturbanceRanges, robot: RobotModel, one: Callable[[str, Range], float]) -> dict[str, float]:
    drawn: dict[str, float] = {}
    for pattern, limits in ranges.strength.items():
        drawn |= dict.fromkeys(joints_like(robot, pattern), one(f"strength.{pattern}", limits))
    return {joint: share for joint, share in drawn.items() if share != 1.0}


def _senses(streams: Streams, ranges: SenseRanges, one: Callable[[str, Range], float]) -> SenseErrors:
    def sits(turn: str, shift: str) -> Misalignment:
        turned, shifted = (_vector(streams(f"disturbances.senses.{k}"), getattr(ranges, k)) for k in (turn, shift))
        return Misalignment(turned, shifted)

    rest = {
        key: one(f"senses.{key}", getattr(ranges, key))
        for key in ("spindle_rad", "focal", "baseline", "pixel_noise", "range_noise", "exposure")
    }
    return SenseErrors(sits("camera_turn_rad", "camera_shift_m"), sits("lidar_turn_rad", "lidar_shift_m"), **rest)
