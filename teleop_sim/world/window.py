"""A plant in MuJoCo's own viewer, as it is posed: nothing is stepped, the mouse moves the camera."""

from __future__ import annotations

import os
import sys
import threading
import warnings
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from teleop_sim.world.drawing import CannotDraw, View
from teleop_sim.world.plant import Plant

CLOSES_S = 5.0
"""Longest wait for a window to go (assumed)."""
NO_DISPLAY = "there is no display to open a window on", "A video needs none: teleop-sim replay LOG --video run.mp4."


class Window:
    """MuJoCo's viewer on a plant.

    Args:
        plant: is shown as it is posed at each ``show``.
        view: where its camera is at first.
        follow: the body that the camera goes along with; empty: it stays.
        pressed: called with the code of each key (GLFW's), from the viewer's thread.

    Raises:
        CannotDraw: there is no display here.

    """

    def __init__(self, plant: Plant, view: View, follow: str, pressed: Callable[[int], None]) -> None:
        need_display()
        from mujoco import viewer

        light = plant.model.vis.headlight
        light.ambient[:], light.diffuse[:], light.specular[:] = 0.4, 0.55, 0.0
        before = set(threading.enumerate())
        self._handle: Any = viewer.launch_passive(
            plant.model, plant.data, key_callback=pressed, show_left_ui=False, show_right_ui=False
        )
        self._threads = [thread for thread in threading.enumerate() if thread not in before]
        with self._handle.lock():
            camera = self._handle.cam
            camera.lookat[:] = view.at_m
            camera.azimuth, camera.elevation = np.degrees(view.azimuth_rad), np.degrees(view.elevation_rad)
            camera.distance = view.distance_m
            if follow:
                camera.type = mujoco.mjtCamera.mjCAMERA_TRACKING
                camera.trackbodyid = plant.model.body(follow).id
            self._handle.opt.sitegroup[:] = 0  # boxes of touch sensors would hide hands and soles

    @property
    def open(self) -> bool:
        """Whether its user has not closed it."""
        return bool(self._handle.is_running())

    def lock(self) -> threading.RLock:
        """To be held while the plant is posed: the window draws in a thread of its own."""
        held: threading.RLock = self._handle.lock()
        return held

    def show(self, left: str, right: str) -> None:
        """Draw the plant as it is posed now, with two columns of words."""
        self._handle.set_texts((mujoco.mjtFontScale.mjFONTSCALE_150, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT, left, right))
        self._handle.sync()

    def close(self) -> None:
        """Close it, and wait until it is gone."""
        # Python's end takes OpenGL away: a thread that still drew would crash the process.
        self._handle.close()
        for thread in self._threads:
            thread.join(CLOSES_S)


def need_display() -> None:
    """Ask before mujoco does: its viewer fails in a thread, and whoever opened it would wait for ever.

    Raises:
        CannotDraw: there is no display here.

    """
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise CannotDraw(*NO_DISPLAY)
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if not glfw.init():
            raise CannotDraw(*NO_DISPLAY)
