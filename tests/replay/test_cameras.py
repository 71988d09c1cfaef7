"""Robot and thing are in the picture."""

import numpy as np
import pytest

from teleop_sim.replay.cameras import CAMERAS, FAR_M, FOV_RAD
from teleop_sim.replay.names import CAMERA_NAMES
from teleop_sim.replay.scene import Scene

WIDE = 1.5


def seen(view, points) -> np.ndarray:
    """Where points are in a picture: right and up, 1 is its edge; a pinhole camera of its own, by rotation matrices."""
    a, e = view.azimuth_rad, view.elevation_rad
    yaw = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    pitch = np.array([[np.cos(e), 0, -np.sin(e)], [0, 1, 0], [np.sin(e), 0, np.cos(e)]])
    ahead, left, up = ((np.atleast_2d(points) - view.at_m) @ (yaw @ pitch)).T
    depth = (ahead + view.distance_m) * np.tan(FOV_RAD / 2)
    assert (depth > 0).all()
    return np.stack([-left / depth / WIDE, up / depth], axis=1)


def test_names_and_cameras_are_the_same():
    assert list(CAMERAS) == list(CAMERA_NAMES)


@pytest.mark.parametrize("which", ["dish", "door", "valve"])
@pytest.mark.parametrize("camera", list(CAMERAS))
def test_the_robot_is_in_every_picture_and_the_thing_when_it_is_near(which, camera, request):
    run = request.getfixturevalue(which)
    scene = Scene.of(run.log)
    robot = [joint.child for joint in run.body.spec.model.description.joints]
    near = 0
    for t_s in np.linspace(0.0, run.log.end_s, 30):
        scene.at(t_s)
        view, bodies = CAMERAS[camera](scene, t_s), scene.bodies()
        # In depth as in width: nothing of the robot is clipped.
        assert np.abs(seen(view, [bodies[name][:3] for name in robot])).max() < 1.0
        away_m = np.linalg.norm(scene.track.at(t_s).pelvis[:2] - scene.thing[:2])
        if camera == "station" or away_m < FAR_M:
            near += 1
            assert np.abs(seen(view, scene.thing)).max() < 1.0
    assert near > 5


def test_a_camera_does_not_sway_with_the_steps(dish):
    """The pelvis swings by some centimetres and degrees a step; what follows it less than half as much."""
    scene = Scene.of(dish.log)
    start_s, walk = max(dish.watched.episodes, key=lambda e: e[1].physics_s)
    times_s = start_s + np.arange(4.0, walk.physics_s - 4.0, 0.1)
    turned = np.unwrap([CAMERAS["behind"](scene, t).azimuth_rad for t in times_s])
    pelvis = np.unwrap(np.interp(times_s, scene.track.t_s, np.unwrap(scene.track.headings_rad)))
    assert np.abs(np.diff(turned, 2)).mean() < 0.5 * np.abs(np.diff(pelvis, 2)).mean()


def test_the_station_stays(door):
    scene = Scene.of(door.log)
    assert CAMERAS["station"](scene, 0.0) == CAMERAS["station"](scene, door.log.end_s)
