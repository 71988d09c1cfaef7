"""Marks of claims: where a picture should show what a robot believes, and how its head gets there."""

import math

import numpy as np
import pytest

from teleop_sim.channel.messages import encode_image
from teleop_sim.field_claims import marks_message
from teleop_sim.robot.commands import CircularAffordance, Detect, Look, Scan
from teleop_sim.robot.perception.camera import FIELD_RAD, HEIGHT, WIDTH, pixel_directions, project
from teleop_sim.robot.perception.rays import SensorPose
from teleop_sim.robot.programs.claims import LOWEST_RAD, knob, look_at
from teleop_sim.robot.programs.pacing import pacing
from teleop_sim.robot.programs.places import middle
from teleop_sim.robot.programs.src_dish import dish_programs
from teleop_sim.robot.programs.steps import Claim, Mark, Memory, Reply
from teleop_sim.robot.sightings import ConsoleGlimpse
from teleop_sim.world import console

AHEAD = SensorPose(np.eye(3), np.array([0.5, -0.2, 1.6]))
HERE = Look(0.0)


def test_projection_is_the_inverse_of_the_camera_s_rays():
    across, down = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    points = AHEAD.position + 2.7 * pixel_directions(WIDTH, HEIGHT)
    seen = project(points, AHEAD)
    assert np.abs(seen - np.stack([across.ravel(), down.ravel()], axis=-1)).max() < 1e-9


def test_what_is_behind_has_no_place_in_a_picture():
    assert np.isnan(project(AHEAD.position - np.array([[1.0, 0.0, 0.0]]), AHEAD)).all()


def test_a_ball_s_mark_has_its_place_and_size():
    image = encode_image(np.zeros((HEIGHT, WIDTH), np.uint8), WIDTH, HEIGHT, 50)
    claim = Claim(
        "/X", (Mark("yaw_handle", (2.5, -0.2, 1.6), 0.1), Mark("pitch_handle", (-1.0, 0.0, 1.6), 0.1)), HERE, HERE
    )
    (mark,) = marks_message(claim, 7, image, AHEAD, (WIDTH, HEIGHT)).places
    focal_px = WIDTH / 2 / math.tan(FIELD_RAD / 2)
    assert (mark.what, mark.across, mark.down) == ("yaw_handle", WIDTH / 2, HEIGHT / 2)
    assert mark.half_width == pytest.approx(focal_px * 0.1 / 2.0)


@pytest.mark.parametrize("angle_rad", [0.0, 1.0, -2.5])
def test_a_knob_is_where_the_console_s_own_geometry_has_it(angle_rad):
    x, _, z = console.wheel_axes()
    handle = CircularAffordance(
        console.wheel_centre(True), z, x, console.KNOB_ORBIT_M, console.KNOB_HEIGHT_M, angle_rad
    )
    assert knob(handle) == pytest.approx(console.knob_centre(True, angle_rad))


def test_the_head_turns_to_the_console():
    look = look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0)
    assert look.yaw_rad == 0.0
    assert look.pitch_rad == pytest.approx(math.pi / 4)
    assert look_at((1.0, 1.0, math.pi / 2), (0.5, 2.0, math.pi / 2), 1.0).yaw_rad == pytest.approx(math.atan2(0.5, 1.0))
    assert look_at((0.0, 0.0, 0.0), (0.2, 0.0, 0.0), 1.0).pitch_rad == LOWEST_RAD


GLIMPSE = ConsoleGlimpse((3.0, 0.2, 0.9), (3.0, -0.2, 0.9))


def looked(memory: Memory) -> tuple[Detect, ...]:
    """Run the coarse detection once on a console that is seen; the detections asked for."""
    program, reply, asked = dish_programs(pacing("eager"))["STATE_DETECT_PANEL_COARSE"](memory), None, []
    while True:
        try:
            step = program.send(reply)
        except StopIteration:
            return tuple(asked)
        reply = None
        if isinstance(step, Detect):
            asked.append(step)
            found = GLIMPSE if step.stage == "coarse" else None
            reply = Reply("found" if found else "not_found", "", found, 0.1)
        elif isinstance(step, Look | Scan):
            reply = Reply("reached", "", None, 1.0)


def test_a_place_that_was_rejected_is_avoided_the_next_time():
    memory = Memory()
    assert looked(memory)[0].avoid == ()
    # The state begins anew: nobody has walked to what was offered.
    assert looked(memory)[0].avoid == (middle(GLIMPSE),)


def test_a_place_that_was_walked_to_is_not():
    memory = Memory()
    looked(memory)
    next(dish_programs(pacing("eager"))["STATE_WALK_TO_SEE_PANEL"](memory))
    assert looked(memory)[0].avoid == ()
