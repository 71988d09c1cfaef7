"""SRC task 1 as a MuJoCo scene: soil, walkway, console with two crank wheels, dish.

World frame: the robot's odometry frame; z = 0 is the walkway's surface, the soil lies at -0.1 m.
Who touches whom: ``teleop_sim.world.contact``.

Not modelled: the Martian terrain's unevenness, the rover and all later tasks, the dish controller's integral term (the
dish is weightless instead, so that it has nothing to hold).

Source of figures: teleop_sim.world.console and teleop_sim.world.dish_layout, unless a line says otherwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world import console as shape
from teleop_sim.world import contact
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.dish_draw import DishWorld, Range
from teleop_sim.world.dish_ground import add_walkway

Rgb = tuple[float, float, float]

SOIL_Z_M = -shape.WALKWAY_HEIGHT_M
PITCH_RANGE_RAD: Range = (-0.2, 1.57)
"""Joint limits of the dish; its yaw has none."""

# Without a near-rigid friction constraint a loaded wheel creeps: 20 Nm stuck turned 66 degrees at MuJoCo's default.
_STUCK_SOLIMP = [0.9999, 0.9999, 0.001, 0.5, 2.0]
_SOIL_RGB: Rgb = (0.55, 0.36, 0.24)
_TILE_RGB: Rgb = (0.62, 0.62, 0.60)
# Dull colours of rocks, crates and boxes, by kind (assumed): nothing as red or blue as the wheels.
_CLUTTER_RGB: dict[str, Rgb] = {
    "rock_1": (0.50, 0.42, 0.30),
    "rock_2": (0.45, 0.33, 0.24),
    "rock_3": (0.42, 0.30, 0.22),
    "crate": (0.75, 0.72, 0.60),
    "crate_long": (0.60, 0.50, 0.35),
    "box": (0.30, 0.32, 0.30),
    "drum_red": shape.RED,
    "drum_blue": shape.BLUE,
}


def add_dish_world(spec: mujoco.MjSpec, world: DishWorld) -> None:
    """Add the scene to a model that already holds the robot: its bodies, joints and actuators come after the robot's.

    Adds joints ``yawWheel``, ``pitchWheel`` (positive is clockwise seen from above), ``dishYaw``, ``dishPitch``, and
    position actuators of the last two names. All four joints are 0 at the start.
    """
    _add_ground(spec, world)
    _add_clutter(spec, world)
    body = spec.worldbody.add_body(
        name="console", pos=[world.console[0], world.console[1], SOIL_Z_M], quat=_yaw_quat(world.console[2])
    )
    _add_console(body, world.contact_friction)
    for left in (True, False):
        _add_wheel(body, left, world)
    _add_dish(spec, body)
    light = spec.worldbody.add_light(name="sun", type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    light.dir, light.pos = [-v for v in world.light.to_sun], [20.0 * v for v in world.light.to_sun]
    light.diffuse, light.ambient = list(world.light.sun), [world.light.ambient] * 3


def _add_ground(spec: mujoco.MjSpec, world: DishWorld) -> None:
    for name, rgb in (("soil", _SOIL_RGB), ("tile", _TILE_RGB)):
        spec.add_material(name=name, rgba=[*rgb, 1.0])
    look = {
        "friction": contact.rough(world.floor_friction),
        "condim": 3,
        "solref": contact.SOLE_SOLREF,
        **contact.WORLD,
    }
    spec.worldbody.add_geom(
        name="soil",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[0.0, 0.0, SOIL_Z_M],
        size=[30.0, 30.0, 0.1],
        material="soil",
        rgba=[*_SOIL_RGB, 1.0],
        **look,
    )
    add_walkway(spec, lay.layout(world.layout_id), {"material": "tile", "rgba": [*_TILE_RGB, 1.0], **look})


def _add_clutter(spec: mujoco.MjSpec, world: DishWorld) -> None:
    for number, thing in enumerate(world.clutter):
        rock, drum = thing.kind.startswith("rock"), thing.kind.startswith("drum")
        solid = mujoco.mjtGeom.mjGEOM_CYLINDER if drum else mujoco.mjtGeom.mjGEOM_BOX
        x, y, yaw = thing.pose
        spec.worldbody.add_geom(
            name=f"clutter{number}",
            type=mujoco.mjtGeom.mjGEOM_ELLIPSOID if rock else solid,
            pos=[x, y, SOIL_Z_M + (0.0 if rock else thing.half[2])],
            quat=_yaw_quat(yaw),
            size=[thing.half[0], thing.half[2], 0.0] if drum else list(thing.half),
            rgba=[*_CLUTTER_RGB[thing.kind], 1.0],
            friction=contact.rough(world.floor_friction),
            **contact.WORLD,
        )


def _grip(friction: float) -> dict[str, object]:
    return {"friction": contact.rough(friction), "condim": 4, "solref": contact.GRIP_SOLREF, **contact.WORLD}


def _add_console(body: mujoco.MjsBody, friction: float) -> None:
    for number, block in enumerate(shape.BLOCKS):
        body.add_geom(
            name=f"console{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=list(block.centre),
            size=list(block.half),
            quat=_lean_quat(block.lean_rad),
            rgba=[*shape.CONSOLE_GREY, 1.0],
            **_grip(friction),
        )


def _add_wheel(console: mujoco.MjsBody, left: bool, world: DishWorld) -> None:
    name, which = ("yawWheel", 0) if left else ("pitchWheel", 1)
    wheel = console.add_body(name=name, pos=list(shape.wheel_centre(left)), quat=_lean_quat(shape.TILT_RAD))
    wheel.explicitinertial, wheel.ipos = True, [0.0, 0.0, 0.0]
    wheel.mass, wheel.inertia = shape.WHEEL_MASS_KG, list(shape.WHEEL_INERTIA)
    joint = wheel.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, -1.0])
    joint.frictionloss, joint.damping, joint.armature = world.wheel_friction_nm[which], np.zeros(3), 0.0
    joint.solimp_friction, joint.solref_friction = _STUCK_SOLIMP, [0.01, 1.0]
    grip = {"mass": 0.0, **_grip(world.contact_friction)}
    a = world.wheel_start_rad[which]
    x, y = shape.KNOB_ORBIT_M * math.cos(a), shape.KNOB_ORBIT_M * math.sin(a)
    foot = shape.WHEEL_HALF_THICKNESS_M
    wheel.add_geom(
        name=f"{name}Disc",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[shape.WHEEL_RADIUS_M, foot, 0.0],
        rgba=[*(shape.RED if left else shape.BLUE), 1.0],
        **grip,
    )
    wheel.add_geom(
        name=f"{name}Stem",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[x, y, foot, x, y, foot + shape.STEM_LENGTH_M],
        size=[shape.STEM_RADIUS_M, 0.0, 0.0],
        rgba=[*shape.GREY, 1.0],
        **grip,
    )
    wheel.add_geom(
        name=f"{name}Knob",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=[x, y, shape.KNOB_HEIGHT_M],
        size=[shape.KNOB_RADIUS_M, 0.0, 0.0],
        rgba=[*shape.GREY, 1.0],
        **grip,
    )


def _add_dish(spec: mujoco.MjSpec, console: mujoco.MjsBody) -> None:
    """Mast, pivot and dish, driven like the published joints: kp 1000, kd 10, damping 1000 and 100 N m s/rad."""
    mast_half = 0.5 * shape.PIVOT_HEIGHT_M
    console.add_geom(
        name="mast",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=[shape.PIVOT_AHEAD_M, 0.0, mast_half],
        size=[0.09, mast_half, 0.0],
        rgba=[0.70, 0.70, 0.70, 1.0],
        **contact.WORLD,
    )
    pivot = console.add_body(name="dishPivot", pos=[shape.PIVOT_AHEAD_M, 0.0, shape.PIVOT_HEIGHT_M])
    pivot.explicitinertial, pivot.mass, pivot.inertia = True, 0.82, [0.00073, 0.000598, 0.00057]
    # The published dish frame has its y axis where the console frame has x: axes and inertia are swapped accordingly.
    dish = pivot.add_body(name="dish", gravcomp=1.0)
    dish.explicitinertial, dish.mass, dish.ipos = True, 17.0, [0.2 * math.cos(0.43), 0.0, 0.2 * math.sin(0.43)]
    dish.inertia = [1.87729, 0.92468, 0.97826]
    joints = (
        (pivot, "dishYaw", [0.0, 0.0, -1.0], 1000.0),
        (dish, "dishPitch", [0.0, -1.0, 0.0], 100.0),
    )
    for body, name, axis, damping in joints:
        joint = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        joint.damping, joint.armature, joint.frictionloss = np.array([damping, 0.0, 0.0]), 0.0, 0.0
        joint.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=1000.0, kv=10.0)
        actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_FALSE
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE
    pitch = spec.joint("dishPitch")
    scale = 180.0 / math.pi if spec.compiler.degree else 1.0
    pitch.limited, pitch.range = mujoco.mjtLimited.mjLIMITED_TRUE, [v * scale for v in PITCH_RANGE_RAD]
    _add_bowl(dish)


def _add_bowl(dish: mujoco.MjsBody) -> None:
    """Only to be seen: size and place are assumed; it looks over the console and up."""
    dish.add_geom(
        name="bowl",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=[0.3, 0.0, 0.4],
        size=[1.1, 0.03, 0.0],
        quat=[math.cos(-0.45), 0.0, math.sin(-0.45), 0.0],
        rgba=[0.85, 0.85, 0.83, 1.0],
        **contact.DECOR,
    )


def _yaw_quat(yaw_rad: float) -> list[float]:
    return [math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad)]


def _lean_quat(lean_rad: float) -> list[float]:
    """Lean towards the robot: the z axis moves towards -x."""
    return [math.cos(0.5 * lean_rad), 0.0, -math.sin(0.5 * lean_rad), 0.0]


# --- signals --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class DishSignals:
    """What the wheels and the dish tell: joint angles [rad], clockwise positive for both wheels."""

    yaw_wheel_rad: float
    pitch_wheel_rad: float
    dish_yaw_rad: float
    dish_pitch_rad: float

    def values(self) -> dict[str, float]:
        """The status values that a ``Follow`` can watch."""
        return {"dish_yaw": self.dish_yaw_rad, "dish_pitch": self.dish_pitch_rad}

    def dish_command_rad(self, checkpoint: int) -> tuple[float, float]:
        """Control of the actuators ``dishYaw`` and ``dishPitch``: the dish follows the wheels from checkpoint 1 on.

        Not modelled: after checkpoint 3 the published dish stops following; nothing tests it then.
        """
        if checkpoint < 1:
            return (0.0, 0.0)
        pitch = shape.DISH_PER_WHEEL * self.pitch_wheel_rad
        return (
            shape.DISH_PER_WHEEL * self.yaw_wheel_rad,
            min(max(pitch, PITCH_RANGE_RAD[0]), PITCH_RANGE_RAD[1]),
        )
