"""The robot for planning: a Pinocchio model with a free-floating pelvis, its joints by name, soles and hands.

Pinocchio orders joints depth first as the description lists them, MuJoCo by its own tree: everything here goes by name.
A configuration ``q`` is ``[x, y, z, quaternion x, y, z, w, joints]``; its velocity ``[v, omega, joint rates]`` has the
pelvis' part in the pelvis' own frame.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from teleop_sim.robot.commands import Side
from teleop_sim.robot.hands import robot_of
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.description import Description, Joint, Link, inertia_matrix, rotation_rpy
from teleop_sim.world.robot_model import HandMount, RobotModel, Shape

SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class Limb:
    """A capsule of an arm: the joint that moves it, its ends (3, 3) with the middle between them [m], its radius."""

    joint: int
    points: np.ndarray
    radius_m: float


@dataclass(frozen=True)
class Kinematics:
    """The planning model. ``data`` is scratch space: every call that reads it fills it first.

    Attributes:
        joint_names: of the driven joints, in the order of ``q[7:]``.
        lower, upper: their limits [rad].
        soles: frame numbers of left and right sole (origin under the sole box's middle).
        tools: frame numbers of the hands' tool frames, by side.
        carriers: joint number by link.
        torso, legs: joint names. arms: joint names by side, from the shoulder out.
        trunk, trunk_joint: the box on the last torso joint's link.
        limbs: capsules of each arm, that plans keep off the trunk.
        mass_kg: of the robot with its hands.
        torso_per_arm: mass of the torso over that of one arm with its hand.

    """

    model: Any
    data: Any
    joint_names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    soles: tuple[int, int]
    tools: dict[Side, int]
    carriers: dict[str, int]
    torso: tuple[str, ...]
    legs: tuple[str, ...]
    arms: dict[Side, tuple[str, ...]]
    trunk: Shape
    trunk_joint: int
    limbs: dict[Side, tuple[Limb, ...]]
    mass_kg: float
    torso_per_arm: float

    def positions(self, names: Sequence[str]) -> np.ndarray:
        """Places of these joints in ``q``; one less is their place in a velocity."""
        return np.array([7 + self.joint_names.index(name) for name in names], dtype=int)

    def assemble(
        self, rotation: np.ndarray, position: np.ndarray, places: np.ndarray, values: np.ndarray
    ) -> np.ndarray:
        """Return ``q`` from the pelvis' rotation (3, 3), its position (3,) [m] and joints [rad]; others are 0.

        ``places`` are ``positions`` of the names in whose order ``values`` stand.
        """
        q = np.zeros(self.model.nq)
        q[:3] = position
        q[3:7] = pin.Quaternion(rotation).coeffs()
        q[places] = values
        return q

    def tool_pose(self, q: np.ndarray, side: Side) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) and position (3,) [m] of a hand's tool frame in the world."""
        pin.forwardKinematics(self.model, self.data, q)
        placement = pin.updateFramePlacement(self.model, self.data, self.tools[side])
        return placement.rotation.copy(), placement.translation.copy()

    def tool_place(self, q: np.ndarray, side: Side) -> np.ndarray:
        """Position (3,) [m] of a hand's tool frame in the world."""
        pin.forwardKinematics(self.model, self.data, q)
        place: np.ndarray = pin.updateFramePlacement(self.model, self.data, self.tools[side]).translation
        return place

    def centre_of_mass(self, q: np.ndarray) -> np.ndarray:
        """Of the whole robot, in the world (3,) [m]."""
        return np.array(pin.centerOfMass(self.model, self.data, q))


@functools.cache
def kinematics_of(robot: str) -> Kinematics:
    """The planning model of a robot by its description's name."""
    return build(robot_of(robot))


def build(spec: RobotSpec) -> Kinematics:
    """Make the planning model of a robot from the same description as its physical model."""
    description = spec.model.description
    model = pin.Model()
    root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    model.appendBodyToJoint(root, _inertia(description.link(description.root)), pin.SE3.Identity())
    carriers = {description.root: int(root)}
    # Depth first: Pinocchio's algorithms take the joints of a subtree to be neighbours.
    for joint in description.depth_first():
        carriers[joint.child] = number = _add_joint(model, carriers[joint.parent], joint)
        model.appendBodyToJoint(number, _inertia(description.link(joint.child)), pin.SE3.Identity())
    # All frames go in before any Data is made: a frame added later is written past the end of older Data.
    feet = (description.sole.left, description.sole.right)
    soles = [_add_sole(model, carriers[foot], description, foot) for foot in feet]
    tools = {side: _add_hand(model, carriers[m.palm], m) for side in SIDES for m in spec.model.hands if m.side == side}
    data = model.createData()
    return Kinematics(
        model=model,
        data=data,
        joint_names=tuple(model.names)[2:],
        lower=model.lowerPositionLimit[7:].copy(),
        upper=model.upperPositionLimit[7:].copy(),
        soles=(soles[0], soles[1]),
        tools=tools,
        carriers=carriers,
        torso=spec.torso,
        legs=(*spec.legs[0], *spec.legs[1]),
        arms={side: spec.arms[side] for side in SIDES},
        trunk=_shape_moved_by(spec.torso[-1], spec.model),
        trunk_joint=int(model.getJointId(spec.torso[-1])),
        limbs={side: _limbs(carriers, side, spec.model) for side in SIDES},
        mass_kg=float(pin.computeTotalMass(model)),
        torso_per_arm=_torso_per_arm(model, spec),
    )


def _shape_moved_by(joint: str, model: RobotModel) -> Shape:
    link = model.description.joint(joint).child
    return next(shape for shape in model.shapes if shape.link == link)


def _limbs(carriers: dict[str, int], side: Side, model: RobotModel) -> tuple[Limb, ...]:
    """Capsules of an arm; each link is moved by the joint above it."""
    capsules = [shape for shape in model.shapes if shape.part == f"{side}_arm" and shape.kind == "capsule"]
    ends = [(carriers[shape.link], np.array(shape.a_m), np.array(shape.b_m), shape.radius_m) for shape in capsules]
    return tuple(Limb(joint, np.array([a, (a + b) / 2, b]), radius_m) for joint, a, b, radius_m in ends)


def _torso_per_arm(model: Any, spec: RobotSpec) -> float:
    """Masses as Table I of the WPI paper counts them: arms with hands, legs, head, and the torso is the rest."""
    data = model.createData()
    pin.computeSubtreeMasses(model, data)

    def carried_kg(joint: str) -> float:
        return float(data.mass[model.getJointId(joint)])

    arms_kg = [carried_kg(spec.arms[side][0]) for side in SIDES]
    others_kg = sum(carried_kg(leg[0]) for leg in spec.legs) + (carried_kg(spec.neck[0]) if spec.neck else 0.0)
    return (float(data.mass[0]) - sum(arms_kg) - others_kg) / arms_kg[0]


def _add_joint(model: Any, parent: int, joint: Joint) -> int:
    placement = pin.SE3(rotation_rpy(joint.rpy_rad), np.array(joint.xyz_m))
    limits = (joint.effort_nm, joint.velocity_rad_s, joint.lower_rad, joint.upper_rad)
    kind = pin.JointModelRevoluteUnaligned(np.array(joint.axis))
    return int(model.addJoint(parent, kind, placement, joint.name, *(np.array([limit]) for limit in limits)))


def _inertia(link: Link) -> Any:
    return pin.Inertia(link.mass_kg, np.array(link.com_m), inertia_matrix(link))


def _add_sole(model: Any, ankle: int, description: Description, foot: str) -> int:
    middle = np.array(description.sole.centre_of(foot)) - [0.0, 0.0, description.sole.size_m[2] / 2]
    name = f"{model.names[ankle]}_sole"
    return int(model.addFrame(pin.Frame(name, ankle, pin.SE3(np.eye(3), middle), pin.FrameType.OP_FRAME)))


def _add_hand(model: Any, palm: int, mount: HandMount) -> int:
    placement = pin.SE3(mount.rotation, mount.position_m)
    for lump in mount.hand.lumps:
        inertia = pin.Inertia.FromCylinder(lump.mass_kg, lump.radius_m, lump.length_m)
        model.appendBodyToJoint(palm, inertia, placement * pin.SE3(np.eye(3), np.array(lump.at_m)))
    return int(model.addFrame(pin.Frame(mount.side + "Tool", palm, placement, pin.FrameType.OP_FRAME)))
