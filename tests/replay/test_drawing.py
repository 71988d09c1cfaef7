"""Pictures: what is in them, and what happens where none can be made. Needs EGL (Debian: libegl1, libgl1-mesa-dri)."""

import os
import subprocess
import sys

import numpy as np
import pytest

from teleop_sim.core.errors import TeleopError
from teleop_sim.replay.cameras import behind
from teleop_sim.replay.scene import Scene
from teleop_sim.world.drawing import SKY, CannotDraw, Painter

SIZE = 240, 160


@pytest.fixture(scope="module")
def pictures(dish) -> list[np.ndarray]:
    """From one place: the robot at the start, in the middle of its walk, and the start again."""
    scene = Scene.of(dish.log)
    view = behind(scene, 0.0)
    with Painter(scene.plant, *SIZE) as painter:
        made = []
        for t_s in (0.0, 25.0, 0.0):
            scene.at(t_s)
            made.append(painter.draw(view))
    return made


def test_a_picture_has_the_size_asked_for_and_many_colours(pictures):
    assert all(p.shape == (SIZE[1], SIZE[0], 3) and p.dtype == np.uint8 for p in pictures)
    assert len(np.unique(pictures[0].reshape(-1, 3), axis=0)) > 100


def test_the_sky_is_above_and_the_ground_below(pictures):
    sky = np.array(SKY) * 255
    assert np.abs(pictures[0][0].astype(int) - sky).max(axis=1).min() < 3
    assert np.abs(pictures[0][-1].astype(int) - sky).max(axis=1).min() > 30


def test_nothing_is_left_black(pictures):
    """What no light reaches, and what MuJoCo leaves undrawn, would be."""
    for picture in pictures:
        assert (picture.max(axis=2) < 12).mean() < 0.002


def test_the_robot_is_where_the_middle_of_the_picture_was_and_is_gone_later(pictures):
    change = np.abs(pictures[0].astype(int) - pictures[1]).max(axis=2) > 40
    rows, columns = np.nonzero(change)
    assert 0.01 < change.mean() < 0.5
    # It stands upright: the changed part is higher than wide before it walked off to the right or left.
    assert rows.max() - rows.min() > 0.4 * SIZE[1]
    assert columns.max() - columns.min() < SIZE[0]


def test_the_same_posture_gives_the_same_picture(pictures):
    assert np.array_equal(pictures[0], pictures[2])


WITHOUT = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent.json", "__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent"}


def python(text: str, *args: object, **env: str) -> "subprocess.CompletedProcess[str]":
    clean = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL"}}
    command = [sys.executable, "-c", text, *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, env=clean | env, check=False, timeout=120)


DRAW = """
import sys
import mujoco
from teleop_sim.log.load import load
from teleop_sim.replay.stills import stills
print(len(stills(load(sys.argv[1]), 64, 40)))
"""


@pytest.mark.parametrize("backend", ["", "disable"])
def test_pictures_are_drawn_whatever_backend_mujoco_was_imported_with(dish, backend):
    done = python(DRAW, dish.log.path, **({"MUJOCO_GL": backend} if backend else {}))
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) >= 3


@pytest.mark.parametrize("env", [WITHOUT, {"MUJOCO_GL": "osmesa", "PYOPENGL_PLATFORM": "egl"}], ids=["egl", "osmesa"])
def test_without_a_driver_it_is_said_what_to_install(dish, tmp_path, env):
    text = "import sys; from teleop_sim.cli import main; sys.exit(main())"
    out = tmp_path / "a.mp4"
    done = python(text, "replay", dish.log.path, "--video", out, **env)
    assert done.returncode == 2
    assert done.stderr.startswith("cannot draw: ")
    assert "apt install libegl1 libgl1-mesa-dri" in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_drawn_is_an_error_of_ours():
    error = CannotDraw("why", "what would do")
    assert isinstance(error, TeleopError)
    assert str(error) == "cannot draw: why\n  what would do"
