"""Pictures of a plant for people, drawn off screen.

EGL draws where there is no display and no graphics card; ``MUJOCO_GL=osmesa`` chooses OSMesa instead. Both are asked
for directly, so it does not matter which backend mujoco chose when it was imported.

What robots see is none of this: ``teleop_sim.world.senses`` casts rays.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import mujoco
import numpy as np

from teleop_sim.core.errors import TeleopError
from teleop_sim.world.description import Vector
from teleop_sim.world.plant import Plant

SKY = (0.80, 0.87, 0.94)
"""Red, green, blue of the sky, in which the ground ends far away (all colours and lights assumed: to be seen well)."""
LIGHTS = (((-0.4, 0.5, -0.8), 0.55), ((0.6, -0.5, -0.4), 0.2))
"""Directions of two lamps, and how bright they are."""
GRID_M, GRID_REACH_M, GRID_WIDTH_M = 1.0, 12.0, 0.012
"""Lines on the ground show that something moves: how far apart, how far from the middle of the picture, how wide."""
FOG_M = (9.0, 19.0)
"""How far off things begin to fade, and where they are gone: before the ground of any scenery ends."""
SKY_M, NEAR_M, FAR_M = 40.0, 0.1, 120.0
"""Walls in the fog are the sky: MuJoCo clears pictures to black, and a skybox would have to be in the model."""
HELP = "On Debian: apt install libegl1 libgl1-mesa-dri; or libosmesa6 and MUJOCO_GL=osmesa."
MOST_GEOMS = 2000


class CannotDraw(TeleopError, RuntimeError):
    """Nothing can be drawn on this machine. Fields: why, and what would help."""

    def __init__(self, why: str, hint: str) -> None:
        super().__init__(why, hint)

    def __str__(self) -> str:
        return "cannot draw: {}\n  {}".format(*self.args)


@dataclass(frozen=True)
class View:
    """Where a camera is: ``distance_m`` from ``at_m``, looking at it.

    ``azimuth_rad``: the way it looks, 0 along x, anticlockwise from above. ``elevation_rad``: below 0 it looks down.
    """

    at_m: Vector
    azimuth_rad: float
    elevation_rad: float
    distance_m: float


class Painter:
    """Draws a plant as it is posed, in even light. Close it, or use it in a ``with``.

    Args:
        plant: its lights and quality of drawing are changed.
        width_px, height_px: of every picture.

    Raises:
        CannotDraw: no OpenGL here.

    """

    def __init__(self, plant: Plant, width_px: int, height_px: int) -> None:
        self._plant = plant
        _make_plain(plant.model, width_px, height_px)
        self._gl = _context(width_px, height_px)
        self._context = mujoco.MjrContext(plant.model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(plant.model, MOST_GEOMS)
        for flag, on in (("SHADOW", False), ("REFLECTION", False), ("SKYBOX", False), ("HAZE", False), ("FOG", True)):
            self._scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = on
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0  # boxes of touch sensors would hide hands and soles
        self._camera = mujoco.MjvCamera()
        self._frame = mujoco.MjrRect(0, 0, width_px, height_px)
        self._size = height_px, width_px

    def draw(self, view: View) -> np.ndarray:
        """The plant as it is posed now: red, green, blue, (height, width, 3) uint8."""
        camera, plant = self._camera, self._plant
        camera.lookat[:] = view.at_m
        camera.azimuth, camera.elevation = np.degrees(view.azimuth_rad), np.degrees(view.elevation_rad)
        camera.distance = view.distance_m
        self._gl.make_current()
        mujoco.mjv_updateScene(
            plant.model, plant.data, self._option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        _add_lights(self._scene)
        _add_grid(self._scene, plant.model, view)
        _add_sky(self._scene, view)
        picture = np.empty((*self._size, 3), np.uint8)
        mujoco.mjr_render(self._frame, self._scene, self._context)
        mujoco.mjr_readPixels(picture, None, self._frame, self._context)
        return picture[::-1]  # OpenGL counts rows from below

    def close(self) -> None:
        """Give the context back; nothing can be drawn afterwards."""
        self._context.free()
        self._gl.free()

    def __enter__(self) -> Painter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _make_plain(model: Any, width_px: int, height_px: int) -> None:
    """Even light, whatever a task's own: that may be dusk or glare, to try the robot's cameras."""
    visual = model.vis
    visual.global_.offwidth, visual.global_.offheight = width_px, height_px
    visual.headlight.active = 1
    visual.headlight.ambient[:] = 0.35
    visual.headlight.diffuse[:] = 0.25
    visual.headlight.specular[:] = 0.0
    visual.rgba.fog[:] = (*SKY, 1.0)
    visual.map.fogstart, visual.map.fogend = np.array(FOG_M) / model.stat.extent
    visual.map.znear, visual.map.zfar = NEAR_M / model.stat.extent, FAR_M / model.stat.extent


def _add_lights(scene: mujoco.MjvScene) -> None:
    """Lamps of our own in place of the task's; the first of a scene is the headlight."""
    scene.nlight = 1 + len(LIGHTS)
    for light, (direction, bright) in zip(scene.lights[1:], LIGHTS, strict=False):
        light.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        light.headlight, light.castshadow = 0, 0
        light.dir[:], light.pos[:] = direction, [-20.0 * v for v in direction]
        light.ambient[:], light.diffuse[:], light.specular[:] = 0.0, bright, 0.0


def _add_grid(scene: mujoco.MjvScene, model: Any, view: View) -> None:
    """Lines on every plane of the world."""
    for plane in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).tolist():
        rgba = [*(0.82 * model.geom_rgba[plane, :3]), 1.0]
        z_m = float(model.geom_pos[plane, 2]) + 0.002
        for axis in (0, 1):
            middle = round(view.at_m[axis] / GRID_M)
            count = round(GRID_REACH_M / GRID_M)
            for k in range(middle - count, middle + count + 1):
                at, half = [view.at_m[0], view.at_m[1], z_m], [GRID_REACH_M, GRID_REACH_M, 0.0005]
                at[axis], half[axis] = k * GRID_M, GRID_WIDTH_M / 2
                _add_box(scene, at, half, rgba)


def _add_sky(scene: mujoco.MjvScene, view: View) -> None:
    """Four walls round what is looked at."""
    for axis in (0, 1):
        for way in (-SKY_M, SKY_M):
            at, half = [view.at_m[0], view.at_m[1], 0.0], [1.2 * SKY_M, 1.2 * SKY_M, SKY_M]
            at[axis], half[axis] = at[axis] + way, 0.1
            _add_box(scene, at, half, [*SKY, 1.0])


def _add_box(scene: mujoco.MjvScene, at_m: list[float], half_m: list[float], rgba: list[float]) -> None:
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_BOX, half_m, at_m, np.eye(3).ravel(), rgba)
    scene.ngeom += 1


def _context(width_px: int, height_px: int) -> Any:
    """An OpenGL context of its own, current."""
    try:
        # mujoco picks one backend when it is imported; these are the same classes, whatever it picked.
        if os.environ.get("MUJOCO_GL", "").strip().lower() == "osmesa":
            from mujoco.osmesa import GLContext
        else:
            from mujoco.egl import GLContext
        made = GLContext(width_px, height_px)
        made.make_current()
    except Exception as error:  # the bindings raise whatever they like: ImportError, AttributeError, GLError
        raise CannotDraw(" ".join(str(error).split()) or type(error).__name__, HELP) from error
    return made
