"""Drawing disturbances: nothing asked is nothing drawn, draws keep to their ranges and to themselves."""

import math
from dataclasses import fields, replace
from functools import cache, partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.core.errors import UnknownName
from teleop_sim.core.streams import stream
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.disturbance_draw import PUSHED_UP_TO_S, Ground, carriers, draw_disturbances, joints_like
from teleop_sim.world.disturbance_ranges import (
    DisturbanceRanges,
    PayloadRanges,
    PlateRanges,
    PushRanges,
    SenseRanges,
)
from teleop_sim.world.disturbances import CALM, PATCH_HEIGHT_M, Disturbances, figures
from teleop_sim.world.robot_model import RobotModel

GROUND = Ground(((0.0, 0.0), (2.0, 0.0), (2.0, 3.0)), 0.8)
RICH = DisturbanceRanges(
    floor_friction=(0.4, 1.0),
    bumps=PlateRanges(count=(2, 2), height_m=(0.005, 0.02), length_m=(0.2, 0.4)),
    patches=PlateRanges(friction=(0.1, 0.3)),
    pushes=PushRanges(force_n=(5.0, 30.0), duration_s=(0.1, 0.3), count=(1, 5)),
    payload=PayloadRanges("left_hand", mass_kg=(0.5, 2.0)),
    mass_factor=(0.9, 1.1),
    com_error_m=(0.005, 0.02),
    joint_friction=(0.0, 0.02),
    strength={"*Knee*": (0.7, 0.9), "left*": (0.8, 0.95)},
    delay_s=(0.02, 0.06),
    senses=SenseRanges(
        camera_turn_rad=(0.001, 0.01),
        camera_shift_m=(0.001, 0.01),
        lidar_turn_rad=(0.001, 0.01),
        lidar_shift_m=(0.001, 0.01),
        spindle_rad=(-0.01, 0.01),
        focal=(0.98, 1.02),
        baseline=(0.97, 1.03),
        pixel_noise=(1.0, 3.0),
        range_noise=(1.0, 3.0),
        exposure=(0.5, 2.0),
    ),
)


@cache
def robot(name: str = "valkyrie") -> RobotModel:
    return ROBOTS[name]().model


def drawn(ranges: DisturbanceRanges, seed: int = 1, ground: Ground = GROUND) -> Disturbances:
    return draw_disturbances(partial(stream, seed, 0), ranges, ground, robot())


def test_nothing_asked_is_calm() -> None:
    assert drawn(DisturbanceRanges()) == CALM
    assert list(figures(CALM)) == []


@pytest.mark.parametrize(
    "nothing",
    [
        {"bumps": PlateRanges(height_m=(0.0, 0.0))},
        {"bumps": PlateRanges(count=(0, 0))},
        {"patches": PlateRanges(count=(0, 0), friction=(0.1, 0.1))},
        {"pushes": PushRanges(force_n=(0.0, 0.0))},
        {"pushes": PushRanges(duration_s=(0.0, 0.0))},
        {"pushes": PushRanges(count=(0, 0))},
        {"payload": PayloadRanges("pelvis", mass_kg=(0.0, 0.0))},
        {"strength": {"*": (1.0, 1.0)}},
        {"com_error_m": (0.0, 0.0, 0.0)},
    ],
    ids=str,
)
def test_a_disturbance_of_no_size_is_calm(nothing: dict[str, object]) -> None:
    assert drawn(replace(DisturbanceRanges(), **nothing)) == CALM


def test_one_seed_draws_one_thing() -> None:
    assert drawn(RICH) == drawn(RICH)
    assert drawn(RICH) != drawn(RICH, 2)


def length(vector: tuple[float, float, float]) -> float:
    return math.hypot(*vector)


@given(st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_draws_stay_in_their_ranges(seed: int) -> None:
    what = drawn(RICH, seed)
    assert what.floor_friction is not None
    assert 0.4 <= what.floor_friction <= 1.0
    first, second, patch = what.plates
    for bump in (first, second):
        assert 0.005 <= bump.height_m <= 0.02
        assert 0.1 <= bump.half_length_m <= 0.2
        assert bump.friction == what.floor_friction
    assert 0.1 <= patch.friction <= 0.3
    assert patch.height_m == PATCH_HEIGHT_M
    assert 1 <= len(what.pushes) <= 5
    starts = [0.0, *(push.start_s for push in what.pushes)]
    # Sums of pauses, to rounding.
    assert all(2.5 - 1e-9 <= b - a <= 4.0 + 1e-9 for a, b in pairwise(starts))
    assert all(5.0 - 1e-9 <= length(p.force_n) <= 30.0 + 1e-9 and 0.1 <= p.duration_s <= 0.3 for p in what.pushes)
    assert what.payload is not None
    assert 0.5 <= what.payload.mass_kg <= 2.0
    assert 0.9 <= what.mass_factor <= 1.1
    assert 0.005 - 1e-12 <= length(what.com_error_m) <= 0.02 + 1e-12
    assert 0.0 <= what.joint_friction <= 0.02
    assert 0.02 <= what.delay_s <= 0.06
    senses = what.senses
    for sensor in (senses.camera, senses.lidar):
        assert 0.001 - 1e-12 <= length(sensor.turn_rad) <= 0.01 + 1e-12
        assert 0.001 - 1e-12 <= length(sensor.shift_m) <= 0.01 + 1e-12
    assert abs(senses.spindle_rad) <= 0.01
    assert abs(senses.focal - 1) <= 0.02
    assert abs(senses.baseline - 1) <= 0.03
    assert 1.0 <= min(senses.pixel_noise, senses.range_noise) <= max(senses.pixel_noise, senses.range_noise) <= 3.0
    assert 0.5 <= senses.exposure <= 2.0


FIELDS = [f.name for f in fields(DisturbanceRanges)]


@pytest.mark.parametrize("name", FIELDS)
def test_a_disturbance_left_out_leaves_the_others_as_they_were(name: str) -> None:
    whole = drawn(RICH)
    less = drawn(replace(RICH, **{name: getattr(DisturbanceRanges(), name)}))
    touched = {"bumps": {"plates"}, "patches": {"plates"}, "floor_friction": {"floor_friction", "plates"}}
    changed = {f.name for f in fields(whole) if getattr(whole, f.name) != getattr(less, f.name)}
    assert changed == touched.get(name, {name})
    if name == "bumps":
        assert less.plates == whole.plates[2:]
    if name == "patches":
        assert less.plates == whole.plates[:2]


@pytest.mark.parametrize("name", [f.name for f in fields(SenseRanges)])
def test_an_error_of_the_senses_left_out_leaves_the_others_as_they_were(name: str) -> None:
    whole = drawn(RICH)
    less = drawn(replace(RICH, senses=replace(RICH.senses, **{name: getattr(SenseRanges(), name)})))
    told, rest = ({what: values for what, values, _ in figures(x)} for x in (whole, less))
    assert {what for what in told if told[what] != rest.get(what)} == {
        "senses." + name.replace("camera_", "camera.").replace("lidar_", "lidar.")
    }


def test_a_range_moves_no_draw_but_its_own() -> None:
    wide = replace(RICH, bumps=replace(RICH.bumps, height_m=(0.005, 0.1), count=(3, 3)), mass_factor=(0.5, 2.0))
    first, other = drawn(RICH), drawn(wide)
    assert [replace(p, height_m=0.0) for p in other.plates[:2]] == [replace(p, height_m=0.0) for p in first.plates[:2]]
    assert other.pushes == first.pushes
    assert other.com_error_m == first.com_error_m


def test_bumps_lie_on_the_way_and_across_it() -> None:
    square = PlateRanges(count=(200, 200), along=(0.0, 1.0), yaw_rad=(0.0, 0.0))
    plates = drawn(DisturbanceRanges(bumps=square)).plates
    for plate in plates:
        on_first = plate.y_m == 0.0 and 0.0 <= plate.x_m <= 2.0 and plate.yaw_rad == 0.0
        on_second = plate.x_m == 2.0 and 0.0 <= plate.y_m <= 3.0 and plate.yaw_rad == pytest.approx(math.pi / 2)
        assert on_first or on_second
    # Evenly by length: 2 m of 5 m are 80 of 200, and the standard deviation is 7.
    assert sum(plate.y_m == 0.0 for plate in plates) == pytest.approx(80, abs=4 * 7)
    assert {plate.friction for plate in plates} == {GROUND.friction}


def test_bumps_lie_where_they_are_put() -> None:
    at = ((1.0, 0.5), (-2.0, 3.0))
    plates = drawn(DisturbanceRanges(bumps=PlateRanges(at_m=at, yaw_rad=(0.3, 0.3)))).plates
    assert [(p.x_m, p.y_m, p.yaw_rad) for p in plates] == [(*place, 0.3) for place in at]


def test_pushes_come_as_long_as_a_robot_may_move_and_from_every_side() -> None:
    pushes = drawn(DisturbanceRanges(pushes=PushRanges())).pushes
    assert PUSHED_UP_TO_S - 4.0 < pushes[-1].start_s <= PUSHED_UP_TO_S
    angles = np.array([math.atan2(p.force_n[1], p.force_n[0]) for p in pushes])
    # About 92 directions: their mean vector is 0.1 long, one deviation.
    assert abs(np.exp(1j * angles).mean()) < 0.4
    ahead = drawn(DisturbanceRanges(pushes=PushRanges(direction_rad=(0.0, 0.0), count=(3, 3)))).pushes
    assert [p.force_n for p in ahead] == 3 * [(20.0, 0.0, 0.0)]


def test_a_vector_given_is_taken_and_a_length_points_anywhere() -> None:
    assert drawn(DisturbanceRanges(com_error_m=(0.01, -0.02, 0.0))).com_error_m == (0.01, -0.02, 0.0)
    every = np.array([drawn(DisturbanceRanges(com_error_m=(1.0, 1.0)), seed).com_error_m for seed in range(400)])
    # A third of the square lies in each direction; the mean of 400 is known to 0.03.
    assert np.abs(every.mean(axis=0)).max() < 0.12
    assert (every**2).mean(axis=0) == pytest.approx(np.full(3, 1 / 3), abs=0.06)


def test_the_last_pattern_that_fits_a_joint_counts() -> None:
    weak = {"*Knee*": (0.5, 0.5), "left*": (0.8, 0.8), "leftHipYaw": (1.0, 1.0)}
    strength = drawn(DisturbanceRanges(strength=weak)).strength
    assert (strength["rightKneePitch"], strength["leftKneePitch"]) == (0.5, 0.8)
    assert "leftHipYaw" not in strength
    assert set(strength) == {*joints_like(robot(), "left*"), "rightKneePitch"} - {"leftHipYaw"}


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_both_hands_of_every_robot_can_carry(name: str) -> None:
    mounts = {mount.side: mount for mount in robot(name).hands}
    for side in ("left", "right"):
        link, at_m = carriers(robot(name))[f"{side}_hand"]
        assert link == mounts[side].palm
        assert at_m == pytest.approx(mounts[side].position_m)


def test_a_payload_on_a_link_that_is_not_there_is_refused() -> None:
    with pytest.raises(UnknownName):
        drawn(DisturbanceRanges(payload=PayloadRanges("tail")))


def test_figures_tell_all_that_was_drawn() -> None:
    what = drawn(RICH)
    told = {name: values for name, values, _ in figures(what)}
    assert told["mass_factor"] == (what.mass_factor,)
    assert told["plates[1].x_m"] == (what.plates[1].x_m,)
    assert told["pushes[0].force_n"] == what.pushes[0].force_n
    assert told["strength.leftKneePitch"] == (what.strength["leftKneePitch"],)
    assert told["senses.camera.turn_rad"] == what.senses.camera.turn_rad
    assert told["payload.known"] == (0.0,)
    assert [text for name, _, text in figures(what) if name == "payload.link"] == ["leftPalm"]
    # Seven figures a plate, three a push, five of the payload, two a sensor, six of the other senses, five alone.
    assert len(told) == 7 * 3 + 3 * len(what.pushes) + 5 + 2 * 2 + 6 + 5 + len(what.strength)
