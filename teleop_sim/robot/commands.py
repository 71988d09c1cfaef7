"""What a robot can be told to do: one frozen dataclass a skill.

Places are in the odometry frame: level, z up, origin and heading where the robot was switched on. Odometry is
assumed perfect. Yaw is anticlockwise seen from above. A command is a value: equal commands on equal states with
equal noise keys give equal episodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from teleop_sim.robot.affordance import Affordance, Usability

Side = Literal["left", "right"]
JointGroup = Literal["left_arm", "right_arm", "left_leg", "right_leg", "torso", "neck", "left_hand", "right_hand"]
Vector = tuple[float, float, float]
PlanarPose = tuple[float, float, float]
"""x [m], y [m], yaw [rad]."""


@dataclass(frozen=True)
class Cloud:
    """Points in the odometry frame, (n, 3) float64 [m]; compared by identity, never changed."""

    points: np.ndarray
    origin: Vector

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other


@dataclass(frozen=True)
class CircularAffordance:
    """A handle on a circle: where a hand can take it and how it moves.

    Attributes:
        centre: of the wheel, odometry frame [m].
        axis: unit vector out of the wheel's face; the handle stands on the face.
        zero: unit vector in the wheel's plane towards handle angle 0.
        radius_m: of the circle on which the handle's centre moves.
        height_m: of the handle's centre over the wheel's plane.
        angle_rad: of the handle as last seen, anticlockwise about ``axis`` from ``zero``.

    """

    centre: Vector
    axis: Vector
    zero: Vector
    radius_m: float
    height_m: float
    angle_rad: float


@dataclass(frozen=True)
class Walk:
    """Walk along planar poses; the last is the goal of the middle of the feet. Faces along the way, then turns.

    ``clouds``: what the LIDAR has seen. Where something in them is in the way, the robot goes round it.
    """

    path: tuple[PlanarPose, ...]
    clouds: tuple[Cloud, ...] = ()


@dataclass(frozen=True)
class Step:
    """Move the stance in the robot's own frame (strides, side steps), then turn on the spot."""

    forward_m: float = 0.0
    left_m: float = 0.0
    turn_rad: float = 0.0


@dataclass(frozen=True)
class Look:
    """Turn the head: pitch down and yaw left, relative to the torso."""

    pitch_rad: float
    yaw_rad: float = 0.0
    duration_s: float = 1.0


@dataclass(frozen=True)
class Scan:
    """Spin the LIDAR half a turn; the episode's data is a ``Cloud``, at full density near ``region``."""

    region: Vector | None = None


@dataclass(frozen=True)
class Detect:
    """Find something with the sensors.

    ``stage`` ``coarse`` takes a camera image now; ``fine`` works on ``cloud`` around ``region``.
    ``avoid`` are places already found wrong. ``visited``: where the robot has stood (finish only).
    """

    what: Literal["console", "finish"]
    stage: Literal["coarse", "fine"]
    region: Vector | None = None
    cloud: Cloud | None = None
    avoid: tuple[Vector, ...] = ()
    visited: tuple[PlanarPose, ...] = ()


@dataclass(frozen=True)
class Reach:
    """Bring the open hand over the handle and down to it: 7-joint arm first, then the 10-joint chain."""

    side: Side
    affordance: CircularAffordance


@dataclass(frozen=True)
class Grip:
    """Close or open a hand. Closing ends ``felt`` or ``not_felt``: a small tug tells, by the force in the hand."""

    side: Side
    close: bool


@dataclass(frozen=True)
class Follow:
    """Turn the held handle until a signal of the world is at its target, or something stops it.

    ``signal``: name of a status value that the task gives the robot, such as ``dish_pitch``. ``direction``: +1 is
    anticlockwise about the affordance's axis. Ends ``reached``, ``grip_lost``, ``no_motion``, ``timed_out`` or
    ``no_plan``.
    """

    side: Side
    affordance: CircularAffordance
    direction: int
    signal: str
    target: float
    tolerance: float
    time_limit_s: float = 60.0


@dataclass(frozen=True)
class Release:
    """Open the hand and draw it back off the handle along the axis, then bring the arm home."""

    side: Side
    affordance: CircularAffordance


@dataclass(frozen=True)
class Nudge:
    """Move a hand by a small offset [m] in the pelvis' or the hand's own frame: the operator's direct command."""

    side: Side
    offset: Vector
    frame: Literal["pelvis", "hand"] = "pelvis"


@dataclass(frozen=True)
class Posture:
    """Bring arms, torso and head to a named posture, or some of them (``teleop_sim.robot.predefined``)."""

    name: str
    duration_s: float = 2.0


@dataclass(frozen=True)
class Act:
    """Move what the hand holds along an affordance, from where it is, by ``amount`` [m or rad].

    ``usability``: a frame of the held thing that takes the hand's place; without one the thing in the hand guides it,
    and the hand gives way sideways. ``rigid``: the hand turns with the thing, also about its own approach axis, as one
    round a bar must. ``give_way_n``: sideways force beyond which even a tool gives way, as one whose path is not quite
    known must; without it a tool keeps to its path. ``braced``: the body keeps its heading against the moment of the
    hand's force. ``force_limit_n``: of the wrist's force beyond the weight of what it carries.
    Ends ``reached``, ``force_limit``, ``no_motion``, ``grip_lost``, ``timed_out`` or ``no_plan``.
    """

    side: Side
    affordance: Affordance
    amount: float
    usability: Usability | None = None
    force_limit_n: float = 80.0
    time_limit_s: float = 120.0
    rigid: bool = False
    give_way_n: float | None = None
    braced: bool = False


@dataclass(frozen=True)
class Handle:
    """Something to hold a thing by, in the odometry frame.

    Attributes:
        centre: where the hand's tool goes [m].
        approach: unit vector along which the hand comes to it.
        bar: unit vector along it, across the approach; None where it is round about the approach.
        mass_kg: of the thing. to_centre: from ``centre`` to the thing's centre of mass [m].

    """

    centre: Vector
    approach: Vector
    bar: Vector | None
    mass_kg: float
    to_centre: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Pick:
    """Take a thing by its handle and lift it straight up.

    Ends ``held``, ``missed`` (no weight came into the hand), ``blocked`` (the open hand met something), ``lost``
    (it had the weight and has it no more) or ``no_plan``; missed and blocked hands are drawn back, open.
    """

    side: Side
    handle: Handle
    lift_m: float = 0.1


@dataclass(frozen=True)
class Carry:
    """Bring what a hand holds where it is carried, for walking. Ends ``carried``, ``lost`` or ``no_plan``."""

    side: Side


@dataclass(frozen=True)
class Place:
    """Put down what a hand holds; ``handle``: where its handle is when it stands. Draws the hand back, and home.

    Ends ``placed``, ``no_ground`` (the weight never left the hand: it still holds), ``lost`` (it had left before) or
    ``no_plan``.
    """

    side: Side
    handle: Handle


@dataclass(frozen=True)
class Insert:
    """Push the tip of a held thing into a hole and let it go there.

    Attributes:
        mouth: middle of the hole's rim [m]. axis: unit vector into it.
        tip_m: from the handle's centre to the tip, along the hand's approach.
        depth_m: how far in is in. search_m: how far round the mouth to search.

    Ends ``inserted``, ``force_limit`` (stuck in the hole short of the depth), ``not_found``, ``lost`` or ``no_plan``.
    """

    side: Side
    mouth: Vector
    axis: Vector
    tip_m: float
    depth_m: float
    search_m: float = 0.02


@dataclass(frozen=True)
class Take:
    """Bring a hand round, or into, something fixed: a lever, the gap between a wheel's spokes.

    ``handle``: where the tool goes; its masses do not matter. ``shut``: the hand comes shut, as a rod; otherwise it
    comes open and closes there. Ends ``taken``, ``blocked`` (it met something before it was there, and was drawn back)
    or ``no_plan``.
    """

    side: Side
    handle: Handle
    shut: bool = False


@dataclass(frozen=True)
class PreGrasp:
    """Bring a hand to 10 cm before a handle, open, or shut as a rod, on a way that touches nothing known of.

    ``obstacles``: places that the world model holds full, odometry frame [m]; each is a cube of 5 cm, whether something
    is there or not. Ends ``reached``, or ``no_plan``, whose cause says what is out of reach or in the way.
    """

    side: Side
    handle: Handle
    shut: bool = False
    obstacles: tuple[Vector, ...] = ()


@dataclass(frozen=True)
class Grasp:
    """Lead a hand from before a handle straight in, jaws as they are: ``Fingers`` closes them there.

    ``shut``: whether it goes in as a rod. Ends ``reached``, ``blocked`` (it met something before it was there, and was
    drawn back to where it came from) or ``no_plan`` (it is not before the handle, or the handle is out of reach).
    """

    side: Side
    handle: Handle
    shut: bool = False


@dataclass(frozen=True)
class Fingers:
    """Close or open a hand where it is; a closing arm gives way. Ends ``closed`` or ``opened``."""

    side: Side
    close: bool


@dataclass(frozen=True)
class Retreat:
    """Draw a hand straight back against the handle's approach from where it is felt to be, jaws as they are.

    Ends ``reached`` or ``blocked`` (something holds it).
    """

    side: Side
    handle: Handle
    distance_m: float = 0.10


@dataclass(frozen=True)
class Cartesian:
    """Lead a hand's tool straight to a pose: the operator's direct command.

    ``position``: odometry frame [m]. ``rotation_rad``: rotation vector of the tool in that frame. It ends at a force,
    beyond what the hand felt when it started. Ends ``reached``, ``blocked`` or ``no_plan``.
    """

    side: Side
    position: Vector
    rotation_rad: Vector


@dataclass(frozen=True)
class Joints:
    """Bring all joints of a group to angles [rad], in the robot's own order, jaws as they are.

    Arms, torso and neck: the law moves the legs, and ``Fingers`` the hands. Ends ``reached``, ``blocked`` (a wrist felt
    a force, or a joint was held) or ``refused``: another group or number of joints, or an angle beyond a limit. What is
    in the way is not looked for; the operator does that.
    """

    group: JointGroup
    angles_rad: tuple[float, ...]


@dataclass(frozen=True)
class LetGo:
    """Let a hand lose its load, open it, draw it straight back and bring it home. Always ends ``released``.

    ``shut``: it is drawn back as it is, as a rod, and opened at home.
    """

    side: Side
    shut: bool = False


@dataclass(frozen=True)
class Stop:
    """End what the body is doing: finish the step under way, then stand."""


Command = (
    Act
    | Walk
    | Step
    | Look
    | Scan
    | Detect
    | Reach
    | Grip
    | Follow
    | Release
    | Nudge
    | Posture
    | Pick
    | Carry
    | Place
    | Insert
    | Take
    | PreGrasp
    | Grasp
    | Fingers
    | Retreat
    | Cartesian
    | Joints
    | LetGo
    | Stop
)
