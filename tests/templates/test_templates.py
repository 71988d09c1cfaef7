"""The library, poses and solids: what is published is there, what is computed is right."""

from __future__ import annotations

import math
from importlib import resources

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.core.errors import BadInput, UnknownName
from teleop_sim.robot.templates import CRANK_STANDS
from teleop_sim.templates.elements import box_inertia
from teleop_sim.templates.library import library, read_library
from teleop_sim.templates.poses import Pose, from_quaternion, gap, pose_of, rotation, rotation_vector
from teleop_sim.templates.shapes import Box, Disc, Ring, Rod, bounds, signed
from teleop_sim.world import console, door, valve

NAMES = [t.name for t in library().templates]
TEXT = resources.files("teleop_sim.templates").joinpath("library.toml").read_text(encoding="utf-8")
turns = st.tuples(*[st.floats(-1.8, 1.8)] * 3)
places = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
poses = st.builds(Pose, places, turns)


@given(turns)
def test_a_rotation_vector_comes_back(vector):
    # Length at most 1.8 sqrt(3) = 3.12 < pi. Rounding of a matrix' nine entries, 1e-15, over the sine of a half turn.
    assert rotation_vector(rotation(vector)) == pytest.approx(vector, abs=1e-12)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.48, -0.6, 0.64)])
def test_half_turns_and_no_turn(axis):
    back = np.array(rotation_vector(rotation(np.array(axis) * math.pi)))
    assert np.linalg.norm(back) == pytest.approx(math.pi)
    assert abs(back @ np.array(axis)) == pytest.approx(math.pi)
    assert rotation_vector(np.eye(3)) == (0.0, 0.0, 0.0)


@given(poses, poses, places)
def test_poses_compose_as_their_points_do(outer, inner, point):
    point = np.array(point)
    assert outer.after(inner).place(point) == pytest.approx(outer.place(inner.place(point)), abs=1e-11)
    assert outer.inverse().place(outer.place(point)) == pytest.approx(point, abs=1e-11)
    off_m, off_rad = gap(outer.after(outer.inverse()), Pose())
    assert (off_m, off_rad) == pytest.approx((0.0, 0.0), abs=1e-11)


def test_a_quaternion_is_a_rotation():
    quarter = from_quaternion((1.0, 2.0, 3.0), (0.0, 0.0, 0.7, 0.7))
    assert quarter.rotation_rad == pytest.approx((0.0, 0.0, math.pi / 2))
    assert quarter.place(np.array([1.0, 0.0, 0.0])) == pytest.approx([1.0, 3.0, 3.0])
    # The same turn the other way round.
    assert from_quaternion((0.0, 0.0, 0.0), (0.0, 0.0, -0.7, -0.7)).rotation_rad == pytest.approx((0, 0, math.pi / 2))


SOLIDS = (
    Box((0.1, 0.2, -0.1), (0.3, 0.1, 0.05), (0.3, -0.2, 0.5)),
    Rod((0.0, 0.1, 0.0), (0.2, -0.1, 0.3), 0.04),
    Ring((0.0, 0.0, 0.1), (0.6, 0.0, 0.8), 0.2, 0.03),
    Disc((0.1, 0.0, 0.0), (0.0, 0.6, 0.8), 0.14, 0.02),
)


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda s: type(s).__name__)
def test_distances_are_to_the_nearest_point_of_the_surface(solid):
    rng = np.random.default_rng(3)
    points = rng.uniform(-0.6, 0.6, (400, 3))
    distance, normal = solid.signed(points)
    foot = points - distance[:, None] * normal
    # The foot of the normal is on the surface, and no point of the surface is nearer.
    assert solid.signed(foot)[0] == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1.0)
    surface = foot[np.abs(solid.signed(foot)[0]) < 1e-9]
    nearest = np.linalg.norm(points[:, None] - surface[None], axis=2).min(axis=1)
    assert (nearest >= np.abs(distance) - 1e-12).all()
    low, high = bounds((solid,))
    assert (foot >= low - 1e-9).all()
    assert (foot <= high + 1e-9).all()


def test_normals_are_the_slopes_of_distances():
    rng = np.random.default_rng(4)
    points = rng.uniform(-0.6, 0.6, (300, 3))
    distance, normal = signed(SOLIDS, points)
    step = 1e-6
    slope = np.stack([(signed(SOLIDS, points + step * e)[0] - distance) / step for e in np.eye(3)], axis=1)
    off = np.abs(slope - normal).max(axis=1)
    # Second derivatives are at most 1 over 4 cm or so; where two solids are as near the slope jumps.
    assert np.quantile(off, 0.97) < 1e-4


def test_eleven_published_templates_and_the_console():
    published = [t for t in library().templates if t.source == "vigir_templates"]
    assert [(t.name, t.type_id) for t in published] == [
        ("valve_holes", 2), ("cutting_tool", 4), ("QUAL_valve", 5), ("cutting_wall", 6), ("doorhandle_left", 7),
        ("doorhandle_right", 10), ("door", 8), ("wall_pattern", 9), ("DRC_drill", 17), ("doorlever", 19),
        ("DRC_valve", 29),
    ]  # fmt: skip
    assert sum(len(t.grasps) for t in published) == 120
    counts = {(t.name, h, s): len(t.grasps_of(h, s)) for t in published for h in ("robotiq", "vt_hand") for s in SIDES}
    assert (counts["DRC_valve", "vt_hand", "left"], counts["door", "robotiq", "right"]) == (10, 4)
    assert library().of_type(29).name == "DRC_valve"


SIDES = ("left", "right")


@pytest.mark.parametrize("name", NAMES)
def test_every_template_is_whole(name):
    template = library().named(name)
    assert template.affordances
    for affordance in template.affordances:
        assert math.hypot(*affordance.axis) == pytest.approx(1.0, abs=1e-12)
        assert affordance.extent[0] <= 0.0 <= affordance.extent[1]
        assert affordance.amount != 0.0
        assert template.affordance(affordance.name) is affordance
    for grasp in template.grasps:
        assert math.hypot(*grasp.approach) == pytest.approx(1.0, abs=1e-12)
        before, way = grasp.before(), grasp.pose.matrix @ np.array(grasp.approach)
        assert np.subtract(grasp.pose.position_m, before.position_m) == pytest.approx(grasp.far_m * way, abs=1e-12)
    low, high = bounds(template.shapes)
    assert (low < np.array(template.middle_m)).all()
    assert (high > np.array(template.middle_m)).all()
    assert all(i >= 0.0 for i in template.inertia_kgm2)


def test_pregrasps_come_from_outside():
    # A hand that draws back gets away from the thing: the published approaches are directions of the hand's frame.
    for name in ("cutting_tool", "DRC_drill", "door", "DRC_valve"):
        template = library().named(name)
        for grasp in template.grasps:
            if grasp.hand == "vt_hand":
                near, far = (np.linalg.norm(p.position_m) for p in (grasp.pose, grasp.before()))
                assert far > near, (name, grasp)


def test_affordances_go_with_their_template():
    turn = library().named("door").affordance("turnCW")
    axis, origin = turn.at(Pose((2.0, 1.0, 1.0), (0.0, 0.0, math.pi / 2)))
    assert axis == pytest.approx((0.0, 1.0, 0.0))
    assert origin == pytest.approx((2.0, 1.0, 1.0))
    assert (turn.kind, turn.amount) == ("circular", pytest.approx(math.radians(60.0)))
    with pytest.raises(UnknownName, match="Did you mean 'turnCW'"):
        library().named("door").affordance("turnWC")


def test_stands_are_offered_by_hand():
    stands = library().named("DRC_valve").stands_of("atlas", "left")
    assert [s.id for s in stands] == [1000, 1001]
    assert stands[0].pose.position_m == (-0.7, 0.0, -0.2)


def test_the_console_is_the_worlds():
    template = library().named("dish_console")
    boxes = [s for s in template.shapes if isinstance(s, Box)]
    assert [(b.centre, b.half) for b in boxes] == [(b.centre, b.half) for b in console.BLOCKS]
    discs = [s for s in template.shapes if isinstance(s, Disc)]
    assert [d.centre for d in discs] == [console.wheel_centre(True), console.wheel_centre(False)]
    # Five digits in the file.
    assert discs[0].axis == pytest.approx(console.wheel_axes()[2], abs=1e-5)
    assert template.usabilities[1].pose.position_m == pytest.approx(console.knob_centre(True, 0.0), abs=1e-5)
    for robot, stand in CRANK_STANDS.items():
        for side in SIDES:
            (mine,) = template.stands_of(robot, side)
            x, y, _ = console.wheel_centre(side == "left")
            assert mine.pose.position_m[:2] == pytest.approx(stand.pose((x, y), 0.0, side)[:2], abs=1e-9)
    (grasp,) = template.grasps_of("cage", "left")
    assert grasp.pose.matrix[:, 2] == pytest.approx(-np.array(console.wheel_axes()[2]), abs=1e-4)


def test_door_and_valve_are_the_worlds():
    panel, lever, _ = library().named("door").shapes
    assert panel.half == pytest.approx((door.THICK_M / 2, door.WIDTH_M / 2, door.LEVER_HEIGHT_M), abs=1e-6)
    assert panel.centre[1] + panel.half[1] == pytest.approx(door.BACKSET_M, abs=1e-6)
    assert (lever.radius_m, -lever.start[0]) == (door.LEVER_RADIUS_M, door.LEVER_STANDOFF_M)
    assert lever.end[1] == pytest.approx(-door.LEVER_M)
    ring = library().named("DRC_valve").shapes[0]
    assert (ring.radius_m, ring.tube_m) == (valve.RADIUS_M, valve.RIM_M)


def test_the_inertia_of_a_box():
    # 12 kg, 1 by 2 by 3 m: 4 + 9, 1 + 9, 1 + 4.
    assert box_inertia(12.0, (0.0, 0.0, 0.0), (1.0, 2.0, 3.0)) == pytest.approx((13.0, 10.0, 5.0))


def test_every_mistake_is_told_at_once():
    text = TEXT.replace('kind = "ring"', 'kind = "rng"', 1).replace("mass_kg = 1.465", "mass_kg = -1.0", 1)
    text = text.replace('group = "debris"', 'grup = "debris"', 1).replace("amount_m = 0.1 }", "amount_m = inf }", 1)
    text = text.replace("type_id = 10", "type_id = 8", 1).replace("id = 1070,", "id = 70.5,", 1)
    text = text.replace("approach = [0.0, 1.0, 0.0]", "approach = [0.0, 2.0, 0.0]", 1)
    with pytest.raises(BadInput) as refused:
        read_library(text, "mine.toml")
    said = str(refused.value)
    for what in ("unknown name 'rng'", "-1.0", "unknown name 'grup'", "group: missing", "inf", "8 comes twice", "70.5"):
        assert what in said
    assert "has length 2" in said
    assert said.count("mine.toml") == len(refused.value.problems)


def test_what_is_no_toml_is_refused():
    with pytest.raises(BadInput, match=r"mine\.toml: no TOML"):
        read_library("[[template]", "mine.toml")
    with pytest.raises(UnknownName, match="Did you mean 'door'"):
        library().named("dor")
    with pytest.raises(UnknownName):
        library().of_type(3)


def test_a_pose_from_its_parts():
    matrix = rotation((0.1, 0.2, 0.3))
    assert pose_of(np.array([1.0, 2.0, 3.0]), matrix).rotation_rad == pytest.approx((0.1, 0.2, 0.3))
