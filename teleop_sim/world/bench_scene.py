"""A bench with one thing to move on it: a slide, a wheel, a screw, or a rod in a rack, for trying affordances.

Bench frame: origin where the thing turns or, for a slide and a rack, where its handle stands; z out of the face, x in
the face away from the robot and up, y to the robot's left. The handle is the console's: a ball on a stem
(``teleop_sim.world.console``). Sizes of slide, screw and rod are assumed, friction is the caller's.

Joints: ``slide`` [m], ``wheel`` [rad], or ``screw`` [rad] coupled to ``screwLift`` [m] by its pitch; the rod is free.
Not modelled: rails and threads as contacts; friction is Coulomb's, the same at rest and in motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from teleop_sim.world import console, contact
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.light import NOON, Light
from teleop_sim.world.plant import Plant

Thing = Literal["slide", "wheel", "screw", "rod"]
Triple = tuple[float, float, float]

SLIDE_MASS_KG = 2.0
TRAVEL_M = 0.45
"""Of a slide, either way from where it starts, unless told otherwise."""
ROD_BALL_M, ROD_BALLS_M = 0.033, (0.035, -0.010)
"""The rod's grip: two balls 2 mm thicker than the closed cage, so that jaws press on them instead of on their stop, and
where they are along the rod from where a hand's tool frame goes. On a cylinder between four bars contacts jump along
the lines of touch, and it creeps out."""
ROD_RADIUS_M, ROD_LENGTH_M = 0.008, 0.22
"""``ROD_LENGTH_M``: from the tool frame to the tip."""
ROD_KG = 0.3
SLOT_HALF_M = 0.014
FACE_DROP_M = 0.06
"""Face of the bench under the thing."""

_STUCK_SOLIMP = [0.9999, 0.9999, 0.001, 0.5, 2.0]
"""Near-rigid: a loaded thing creeps at MuJoCo's default (``teleop_sim.world.dish``)."""
_GREY, _RED, _STEEL = [0.6, 0.6, 0.6, 1.0], [0.75, 0.05, 0.05, 1.0], [0.42, 0.43, 0.45, 1.0]


@dataclass(frozen=True)
class Bench(BareFloor):
    """A level floor with a bench.

    Attributes:
        thing: what is on it.
        place: of the bench frame [m].
        tilt_rad: of the face towards the robot, from level.
        yaw_rad: of the bench about the vertical.
        resist: friction of the slide [N], of wheel and screw [N m].
        way_rad: of the slide in the face, from x to y.
        orbit_m: of the handle round wheel or screw.
        start_rad: of the handle on it.
        pitch_m: of the screw.
        travel_m: how far the slide goes either way.
        grip: sliding friction of handle and rod.

    """

    thing: Thing = "slide"
    place: Triple = (0.6, 0.3, 0.9)
    tilt_rad: float = console.TILT_RAD
    yaw_rad: float = 0.0
    resist: float = 10.0
    way_rad: float = math.pi
    orbit_m: float = console.KNOB_ORBIT_M
    start_rad: float = 0.0
    pitch_m: float = 0.01
    travel_m: float = TRAVEL_M
    grip: float = 0.8
    light: Light = NOON

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add the floor, the bench and the thing."""
        super().add_to(spec)
        body = spec.worldbody.add_body(name="bench", pos=self.place, quat=_quat(self.axes()))
        {"slide": _add_slide, "wheel": _add_wheel, "screw": _add_screw, "rod": _add_rack}[self.thing](spec, body, self)

    def axes(self) -> np.ndarray:
        """The bench frame's axes as columns (3, 3) in the world."""
        c, s = math.cos(self.tilt_rad), math.sin(self.tilt_rad)
        a, b = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        turn = np.array([[a, -b, 0.0], [b, a, 0.0], [0.0, 0.0, 1.0]])
        return np.asarray(turn @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]))

    def handle(self) -> np.ndarray:
        """Centre (3,) of the handle, or of the rod's grip, at the start [m]."""
        local = np.zeros(3)
        if self.thing != "rod":
            local[2] = console.KNOB_HEIGHT_M
        if self.thing in ("wheel", "screw"):
            local[:2] = self.orbit_m * math.cos(self.start_rad), self.orbit_m * math.sin(self.start_rad)
        return np.asarray(np.array(self.place) + self.axes() @ local)


def amount(plant: Plant, thing: Thing) -> float:
    """How far the thing has moved [m or rad]: the truth, which no robot sees."""
    return plant.angle(thing)


def rod_tip(plant: Plant) -> np.ndarray:
    """Where the rod's tip is (3,) [m]: the truth."""
    return plant.site("rodTip").position


def _quat(rotation: np.ndarray) -> np.ndarray:
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(rotation).ravel())
    return quat


def _solid(bench: Bench) -> dict[str, object]:
    return {"friction": contact.rough(bench.grip), "condim": 4, "solref": contact.GRIP_SOLREF, **contact.WORLD}


def _add_face(body: mujoco.MjsBody, bench: Bench, half: tuple[float, float]) -> None:
    """What the thing is mounted on: hands must not go through it."""
    body.add_geom(
        name="benchFace",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[0.0, 0.0, -FACE_DROP_M - 0.01],
        size=[*half, 0.01],
        rgba=_STEEL,
        **_solid(bench),
    )


def _joint(
    body: mujoco.MjsBody, name: str, kind: mujoco.mjtJoint, axis: list[float], friction: float
) -> mujoco.MjsJoint:
    joint = body.add_joint(name=name, type=kind, axis=axis)
    joint.frictionloss, joint.damping, joint.armature = friction, np.zeros(3), 0.0
    joint.solimp_friction, joint.solref_friction = _STUCK_SOLIMP, [0.01, 1.0]
    return joint


def _add_handle(body: mujoco.MjsBody, bench: Bench, x: float, y: float) -> None:
    foot = console.WHEEL_HALF_THICKNESS_M
    body.add_geom(
        name="benchStem",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[x, y, foot, x, y, foot + console.STEM_LENGTH_M],
        size=[console.STEM_RADIUS_M, 0.0, 0.0],
        mass=0.0,
        rgba=_GREY,
        **_solid(bench),
    )
    body.add_geom(
        name="benchKnob",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=[x, y, console.KNOB_HEIGHT_M],
        size=[console.KNOB_RADIUS_M, 0.0, 0.0],
        mass=0.0,
        rgba=_RED,
        **_solid(bench),
    )


def _add_slide(_: mujoco.MjSpec, body: mujoco.MjsBody, bench: Bench) -> None:
    _add_face(body, bench, (0.3, 0.12))
    slide = body.add_body(name="slideCarriage")
    slide.explicitinertial, slide.mass, slide.inertia = True, SLIDE_MASS_KG, [0.01, 0.01, 0.01]
    axis = [math.cos(bench.way_rad), math.sin(bench.way_rad), 0.0]
    joint = _joint(slide, "slide", mujoco.mjtJoint.mjJNT_SLIDE, axis, bench.resist)
    joint.limited, joint.range = mujoco.mjtLimited.mjLIMITED_TRUE, [-bench.travel_m, bench.travel_m]
    half = [0.05, 0.05, console.WHEEL_HALF_THICKNESS_M]
    slide.add_geom(name="benchSlide", type=mujoco.mjtGeom.mjGEOM_BOX, size=half, mass=0.0, rgba=_GREY, **_solid(bench))
    # A level slide on a tilted face must not run away: its weight is carried by a spring balance, as on a sash window.
    slide.gravcomp = 1.0
    _add_handle(slide, bench, 0.0, 0.0)


def _add_wheel(_: mujoco.MjSpec, body: mujoco.MjsBody, bench: Bench) -> None:
    _add_disc(body, bench, "wheel")


def _add_disc(body: mujoco.MjsBody, bench: Bench, name: str) -> mujoco.MjsBody:
    _add_face(body, bench, (0.17, 0.17))
    disc = body.add_body(name=f"{name}Disc")
    disc.explicitinertial, disc.mass, disc.inertia = True, console.WHEEL_MASS_KG, list(console.WHEEL_INERTIA)
    _joint(disc, name, mujoco.mjtJoint.mjJNT_HINGE, [0.0, 0.0, 1.0], bench.resist)
    disc.add_geom(
        name="benchDisc",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[bench.orbit_m + 0.017, console.WHEEL_HALF_THICKNESS_M, 0.0],
        mass=0.0,
        rgba=_STEEL,
        **_solid(bench),
    )
    _add_handle(disc, bench, bench.orbit_m * math.cos(bench.start_rad), bench.orbit_m * math.sin(bench.start_rad))
    return disc


def _add_screw(spec: mujoco.MjSpec, body: mujoco.MjsBody, bench: Bench) -> None:
    disc = _add_disc(body, bench, "screw")
    disc.gravcomp = 1.0
    disc.add_joint(name="screwLift", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0])
    thread = spec.add_equality(
        name="thread",
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1="screwLift",
        name2="screw",
    )
    # Coefficients of a polynomial of the second joint, then what other kinds of equality need.
    thread.data = [0.0, bench.pitch_m / (2 * math.pi), *[0.0] * (len(thread.data) - 2)]
    thread.solref = contact.GRIP_SOLREF


def _add_rack(spec: mujoco.MjSpec, body: mujoco.MjsBody, bench: Bench) -> None:
    """Two rails, open towards the robot, in which the rod hangs by its grip, tip down."""
    top = ROD_BALLS_M[1] - math.sqrt(ROD_BALL_M**2 - SLOT_HALF_M**2)
    for name, sign in (("Left", 1.0), ("Right", -1.0)):
        body.add_geom(
            name=f"benchRail{name}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[0.04, sign * (SLOT_HALF_M + 0.02), top - 0.006],
            size=[0.08, 0.02, 0.006],
            rgba=_STEEL,
            **_solid(bench),
        )
    _add_rod(spec, bench)


def _add_rod(spec: mujoco.MjSpec, bench: Bench) -> None:
    rod = spec.worldbody.add_body(name="rod", pos=list(bench.handle()), quat=_quat(bench.axes()))
    rod.add_freejoint(name="rod")
    # It lies on the rails: the one thing of this world that touches the world.
    solid = {**_solid(bench), "conaffinity": 7}
    for number, z in enumerate(ROD_BALLS_M):
        rod.add_geom(
            name=f"rodBall{number}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=[0.0, 0.0, z],
            size=[ROD_BALL_M, 0.0, 0.0],
            mass=ROD_KG / 6,
            rgba=_RED,
            **solid,
        )
    rod.add_geom(
        name="rodShaft",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0.0, 0.0, ROD_BALLS_M[1] - ROD_BALL_M, 0.0, 0.0, ROD_RADIUS_M - ROD_LENGTH_M],
        size=[ROD_RADIUS_M, 0.0, 0.0],
        mass=ROD_KG * 2 / 3,
        rgba=_GREY,
        **solid,
    )
    rod.add_site(name="rodTip", pos=[0.0, 0.0, -ROD_LENGTH_M])
