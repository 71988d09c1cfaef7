"""A push door with a lever that must be turned past its latch: hinged on the robot's right, opening away from it.

Frame of the door: origin where the lever's axis meets the door's face, x into the door, y to the robot's left, z up.
The lever points to the hinges (-y), as on a common lockset; ``doorLever`` counts downwards, ``doorHinge`` open.

Published (DARPA Robotics Challenge Trials 2013 and Finals 2015, task pages "Door"): a 36 inch doorway, no threshold, a
lever 40 inches over the floor (32 to 48), a Schlage lockset of 2 3/8 inch backset; the Finals' door is pushed and stays
open, the Trials' third door has a weighted closer. Assumed: masses, friction, spring, bolt, lever, closer.

The latch is a bolt that slides in the door, geared to the lever, against a strike in the frame: what holds the door
shut is their contact. Not modelled: the bolt's bevel (a door that falls shut does not latch by itself but stands on its
bolt), jambs and wall, a seal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.light import NOON, Light
from teleop_sim.world.plant import Plant

Triple = tuple[float, float, float]

WIDTH_M, HEIGHT_M, THICK_M = 36 * 0.0254, 80 * 0.0254, 0.04
"""Width published; height and thickness of a common door (assumed)."""
BACKSET_M = 2.375 * 0.0254
LEVER_HEIGHT_M = 40 * 0.0254
LEVER_M, LEVER_RADIUS_M, LEVER_STANDOFF_M = 0.12, 0.010, 0.06
LEVER_TRAVEL_RAD = math.radians(60.0)
HINGE: Triple = (THICK_M / 2, BACKSET_M - WIDTH_M, 0.0)
"""Where the hinges' axis crosses the lever's height, in the door's frame."""
BOLT_THROW_M, BOLT_RADIUS_M, STRIKE_GAP_M = 0.020, 0.006, 0.002
"""The bolt's tip leaves the strike when the lever has gone 40 degrees (measured: ``tests/world/test_drc_door.py``)."""
SPRING_AT_RAD, PRELOAD_RAD = math.radians(40.0), math.radians(30.0)
OPENS_TO_RAD = 1.9

_LATCH = {"contype": 64, "conaffinity": 64, "group": 0}
"""A bit of their own: bolt and strike touch each other and nothing else."""
_STUCK_SOLIMP = [0.9999, 0.9999, 0.001, 0.5, 2.0]
_WOOD, _STEEL = [0.55, 0.4, 0.25, 1.0], [0.75, 0.75, 0.78, 1.0]


@dataclass(frozen=True)
class Door(BareFloor):
    """A level floor with a door. All defaults but ``place``'s height are assumed.

    Attributes:
        place: of the door's frame [m]; z is the lever's height.
        yaw_rad: of the door about the vertical.
        mass_kg: of the panel.
        hinge_nm: friction of the hinges. spring_nm: of the lever's spring at 40 degrees, where the bolt is free.
        closer_rad: how far the hinges' axis leans to the latch, which makes a gravity closer: the open door rises and
            is drawn shut by m g (width / 2) sin(lean) sin(angle).
        grip: sliding friction of panel and lever.

    """

    place: Triple = (0.6, 0.25, LEVER_HEIGHT_M)
    yaw_rad: float = 0.0
    mass_kg: float = 22.0
    hinge_nm: float = 2.0
    spring_nm: float = 2.0
    closer_rad: float = 0.0
    grip: float = 0.7
    light: Light = NOON

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the floor, the door and its latch."""
        super().add_to(spec)
        x, y, z = self.place
        half = self.yaw_rad / 2
        frame = spec.worldbody.add_body(name="doorFrame", pos=[x, y, 0.0], quat=[math.cos(half), 0, 0, math.sin(half)])
        panel = _add_panel(frame, self, z)
        _add_lever(panel, self)
        _add_latch(spec, frame, panel, z)


def opened_rad(plant: Plant) -> float:
    """How far the door is open: the truth, which no robot sees."""
    return plant.angle("doorHinge")


def lever_rad(plant: Plant) -> float:
    """How far the lever is turned down: the truth."""
    return plant.angle("doorLever")


def _solid(door: Door) -> dict[str, object]:
    return {"friction": contact.rough(door.grip), "condim": 4, "solref": contact.GRIP_SOLREF, **contact.WORLD}


def _add_panel(frame: mujoco.MjsBody, door: Door, height_m: float) -> mujoco.MjsBody:
    """The panel's body has its origin on the hinges' axis at the lever's height."""
    x, y, _ = HINGE
    panel = frame.add_body(name="doorPanel", pos=[x, y, height_m])
    axis = [0.0, -math.sin(door.closer_rad), -math.cos(door.closer_rad)]
    joint = panel.add_joint(name="doorHinge", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
    joint.limited, joint.range = mujoco.mjtLimited.mjLIMITED_TRUE, [0.0, OPENS_TO_RAD]
    joint.frictionloss, joint.damping = door.hinge_nm, np.array([0.5, 0.0, 0.0])
    joint.solimp_friction, joint.solref_friction = _STUCK_SOLIMP, [0.01, 1.0]
    panel.add_geom(
        name="doorPanel",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[0.0, WIDTH_M / 2, HEIGHT_M / 2 + 0.01 - height_m],
        size=[THICK_M / 2, WIDTH_M / 2, HEIGHT_M / 2],
        mass=door.mass_kg,
        rgba=_WOOD,
        **_solid(door),
    )
    return panel


def _add_lever(panel: mujoco.MjsBody, door: Door) -> None:
    lever = panel.add_body(name="doorLever", pos=[-THICK_M / 2, WIDTH_M - BACKSET_M, 0.0])
    joint = lever.add_joint(name="doorLever", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[1.0, 0.0, 0.0])
    joint.limited, joint.range = mujoco.mjtLimited.mjLIMITED_TRUE, [0.0, LEVER_TRAVEL_RAD]
    joint.stiffness = np.array([door.spring_nm / (SPRING_AT_RAD + PRELOAD_RAD), 0.0, 0.0])
    joint.springref = -PRELOAD_RAD
    joint.frictionloss, joint.damping, joint.armature = 0.1, np.array([0.05, 0.0, 0.0]), 0.001
    bar = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "size": [LEVER_RADIUS_M, 0.0, 0.0], "rgba": _STEEL, **_solid(door)}
    out = -LEVER_STANDOFF_M
    lever.add_geom(name="doorLever", fromto=[out, 0.0, 0.0, out, -LEVER_M, 0.0], mass=0.3, **bar)
    lever.add_geom(name="doorSpindle", fromto=[-0.012, 0.0, 0.0, out, 0.0, 0.0], mass=0.1, **bar)


def _add_latch(spec: mujoco.MjSpec, frame: mujoco.MjsBody, panel: mujoco.MjsBody, height_m: float) -> None:
    """A bolt in the door's edge and a strike behind which it sits."""
    steel = {"friction": contact.rough(0.2), "condim": 3, "solref": contact.GRIP_SOLREF, "rgba": _STEEL, **_LATCH}
    bolt = panel.add_body(name="doorBolt", pos=[0.0, WIDTH_M, 0.0])
    joint = bolt.add_joint(name="doorBolt", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 1.0, 0.0])
    joint.limited, joint.range = mujoco.mjtLimited.mjLIMITED_TRUE, [-BOLT_THROW_M - 0.002, 0.002]
    # Reflected inertia of the lock's works: a bolt of 0.1 kg alone would jitter in its coupling.
    joint.armature, joint.damping = 0.2, np.array([2.0, 0.0, 0.0])
    bolt.add_geom(
        name="doorBolt",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0.0, -0.03, 0.0, 0.0, BOLT_THROW_M - BOLT_RADIUS_M, 0.0],
        size=[BOLT_RADIUS_M, 0.0, 0.0],
        mass=0.1,
        **steel,
    )
    frame.add_geom(
        name="doorStrike",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[THICK_M / 2 + BOLT_RADIUS_M + 0.011, BACKSET_M + STRIKE_GAP_M + 0.02, height_m],
        size=[0.01, 0.02, 0.05],
        **steel,
    )
    gear = spec.add_equality(
        name="doorGear",
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1="doorBolt",
        name2="doorLever",
    )
    # Coefficients of a polynomial of the second joint, then what other kinds of equality need.
    gear.data = [0.0, -BOLT_THROW_M / LEVER_TRAVEL_RAD, *[0.0] * (len(gear.data) - 2)]
    gear.solref = contact.GRIP_SOLREF
