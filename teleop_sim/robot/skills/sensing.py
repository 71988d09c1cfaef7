"""Scan and detect: the robot stands still, sensors and detectors tell. Computing time is taken as zero (assumed)."""

from __future__ import annotations

import numpy as np

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Cloud, Detect, Scan, Side
from teleop_sim.robot.gait import body_between
from teleop_sim.robot.perception import camera, coarse, fine, lidar, walkway
from teleop_sim.robot.perception.rays import Light, SensorPose, upright
from teleop_sim.robot.skill import Done, Motion
from teleop_sim.robot.tool_poses import tool_pose
from teleop_sim.world.sense_errors import SenseErrors

FRAME_S = 0.1
"""One image: the camera takes 10 a second (multisense_sl.urdf)."""


def camera_pose(body: Body) -> SensorPose:
    """Where the head's left camera is believed to be."""
    return _sensor(body, body.spec.camera_frame)


def _sensor(body: Body, frame: str) -> SensorPose:
    site = body.plant.site(frame)
    return SensorPose(upright(site.rotation), site.position)


def light(body: Body) -> Light:
    """Sun and sky of the scenery, for the camera."""
    sun = body.plant.scenery.light
    return Light(sun.to_sun, sun.sun, sun.ambient)


def picture(body: Body, rng: np.random.Generator) -> camera.Image:
    """A camera image now."""
    return camera.take(body.plant, camera_pose(body), light(body), rng, errors=_errors(body))


def _errors(body: Body) -> SenseErrors:
    return body.plant.disturbances.senses


def scan(body: Body, command: Scan, rng: np.random.Generator) -> Motion:
    """Half a turn of the LIDAR: a cloud of everything round the robot."""
    yield from ()
    pose = _sensor(body, body.spec.lidar_frame)
    points = lidar.half_turn(body.plant, pose, rng, command.region, _errors(body))
    x, y, z = (float(v) for v in pose.position)
    return Done("scanned", data=Cloud(points, (x, y, z)), takes_s=lidar.HALF_TURN_S)


def hand_points(body: Body, rng: np.random.Generator, side: Side) -> lidar.HandPoints:
    """What a half turn at this moment has on one of the robot's hands, and where the robot's joints have it."""
    frame = body.spec.lidar_frame
    tool_m, _ = tool_pose(body, side)
    return lidar.hand_points(body.plant, frame, _sensor(body, frame), tool_m, side, rng, _errors(body))


def detect(body: Body, command: Detect, rng: np.random.Generator) -> Motion:
    """Find the console or the finish. Ends ``found`` with a sighting as data, or ``not_found`` and why."""
    yield from ()
    if command.stage == "coarse":
        glimpse, why = coarse.detect(
            body.plant, camera_pose(body), light(body), rng, command.avoid, errors=_errors(body)
        )
        return _told(glimpse, why, FRAME_S)
    if command.cloud is None:
        return Done("not_found", "no cloud to look in")
    if command.what == "finish":
        here = body_between(body.feet())
        return _told(*walkway.find_finish(command.cloud.points, here, command.visited), 0.0)
    if command.region is None:
        return Done("not_found", "no region to look in")
    return _told(*fine.detect(command.cloud.points, command.region, command.cloud.origin, rng), 0.0)


def _told(sighting: object | None, why: str, takes_s: float) -> Done:
    if sighting is None:
        return Done("not_found", why, takes_s=takes_s)
    return Done("found", why, sighting, takes_s)
