"""The robot for planning: a Pinocchio model with a free-floating pelvis, its joints by name, soles and hands.

Pinocchio orders joints depth first as the description lists them, MuJoCo by its own tree: everything here goes by name.
A configuration ``q`` is ``[x, y, z, quaternion x, y, z, w, joints]``; its velocity ``[v, omega, joint rates]`` has the
pelvis' part in the pelvis' own frame.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np
import pinocchio as pin

from teleop_sim.robot.commands import Side
from teleop_sim.robot.hand import CAGE, CageHand, tool_in_palm

LEG = ("HipYaw", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ARM = ("ShoulderPitch", "ShoulderRoll", "ShoulderYaw", "ElbowPitch", "ForearmYaw", "WristRoll", "WristPitch")
TORSO = ("torsoYaw", "torsoPitch", "torsoRoll")
SIDES: tuple[Side, Side] = ("left", "right")
_FINGER = ("Thumb", "Finger", "Pinky")


@dataclass(frozen=True)
class Kinematics:
    """The planning model. ``data`` is scratch space: every call that reads it fills it first.

    Attributes:
        joint_names: of the driven joints, in the order of ``q[7:]``.
        lower, upper: their limits [rad].
        soles: frame numbers of left and right sole (origin under the sole box's middle).
        tools: frame numbers of the hands' tool frames, by side.

    """

    model: Any
    data: Any
    joint_names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    soles: tuple[int, int]
    tools: dict[Side, int]

    def positions(self, names: Sequence[str]) -> np.ndarray:
        """Places of these joints in ``q``; one less is their place in a velocity."""
        return np.array([7 + self.joint_names.index(name) for name in names], dtype=int)

    def configuration(
        self, rotation: np.ndarray, position: np.ndarray, names: Sequence[str], values: np.ndarray
    ) -> np.ndarray:
        """Return ``q`` from the pelvis' rotation (3, 3), its position (3,) [m] and joints [rad]; unnamed ones are 0."""
        q = np.zeros(self.model.nq)
        q[:3] = position
        q[3:7] = pin.Quaternion(np.asarray(rotation)).coeffs()
        q[self.positions(names)] = values
        return q

    def tool_pose(self, q: np.ndarray, side: Side) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) and position (3,) [m] of a hand's tool frame in the world."""
        pin.forwardKinematics(self.model, self.data, q)
        placement = pin.updateFramePlacement(self.model, self.data, self.tools[side])
        return placement.rotation.copy(), placement.translation.copy()

    def centre_of_mass(self, q: np.ndarray) -> np.ndarray:
        """Of the whole robot, in the world (3,) [m]."""
        return np.array(pin.centerOfMass(self.model, self.data, q))


def arm_joints(side: Side) -> tuple[str, ...]:
    """The seven joints of an arm from the shoulder out."""
    return tuple(side + name for name in ARM)


@functools.cache
def valkyrie(hand: CageHand = CAGE) -> Kinematics:
    """Valkyrie with its fingers folded stiffly into the palms and a cage hand on each.

    Source: ``valkyrie.json`` in this package (its ``source`` says where its figures are from).
    """
    described = json.loads((files("teleop_sim.robot") / "valkyrie.json").read_text())
    return build(described, hand)


def build(described: dict[str, Any], hand: CageHand) -> Kinematics:
    """Make the planning model from a robot's description and its hand."""
    whole = _tree(described)
    fingers = [i for i, name in enumerate(whole.names) if any(part in name for part in _FINGER)]
    model = pin.buildReducedModel(whole, fingers, pin.neutral(whole))
    # All frames go in before any Data is made: a frame added later is written past the end of older Data.
    soles = [_add_sole(model, described["foot"], side) for side in SIDES]
    tools = {side: _add_hand(model, side, hand) for side in SIDES}
    return Kinematics(
        model=model,
        data=model.createData(),
        joint_names=tuple(model.names)[2:],
        lower=model.lowerPositionLimit[7:].copy(),
        upper=model.upperPositionLimit[7:].copy(),
        soles=(soles[0], soles[1]),
        tools=tools,
    )


def _tree(described: dict[str, Any]) -> Any:
    model = pin.Model()
    links = {link["name"]: link for link in described["links"]}
    root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    model.appendBodyToJoint(root, _inertia(links[described["root"]]), pin.SE3.Identity())
    branches: dict[str, list[dict[str, Any]]] = {name: [] for name in links}
    for joint in described["joints"]:
        branches[joint["parent"]].append(joint)

    def grow(link: str, carrier: int) -> None:
        # Depth first: Pinocchio's algorithms take the joints of a subtree to be neighbours.
        for joint in branches[link]:
            number = _add_joint(model, carrier, joint)
            model.appendBodyToJoint(number, _inertia(links[joint["child"]]), pin.SE3.Identity())
            grow(joint["child"], number)

    grow(described["root"], root)
    return model


def _add_joint(model: Any, parent: int, joint: dict[str, Any]) -> int:
    placement = pin.SE3(pin.rpy.rpyToMatrix(np.array(joint["rpy"], float)), np.array(joint["xyz"], float))
    limits = [np.array([float(joint[key])]) for key in ("effort", "velocity", "lower", "upper")]
    kind = pin.JointModelRevoluteUnaligned(np.array(joint["axis"], float))
    number = int(model.addJoint(parent, kind, placement, joint["name"], *limits))
    model.addJointFrame(number, -1)  # what locks a joint later looks for its frame
    return number


def _inertia(link: dict[str, Any]) -> Any:
    xx, xy, xz, yy, yz, zz = link["inertia"]
    about_com = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return pin.Inertia(link["mass"], np.array(link["com"], float), about_com)


def _add_sole(model: Any, foot: dict[str, Any], side: Side) -> int:
    ankle = model.getJointId(side + "AnkleRoll")
    middle = np.array(foot["sole_box_centre_in_foot"], float)
    middle[2] = foot["sole_z_in_foot"]
    frame = pin.Frame(side + "Sole", ankle, pin.SE3(np.eye(3), middle), pin.FrameType.OP_FRAME)
    return int(model.addFrame(frame))


def _add_hand(model: Any, side: Side, hand: CageHand) -> int:
    palm = model.getJointId(side + "WristPitch")
    position, rotation = tool_in_palm(side, hand)
    placement = pin.SE3(rotation, position)
    flange = pin.Inertia.FromCylinder(hand.body_mass_kg, hand.body_radius_m, 2 * hand.body_half_m)
    model.appendBodyToJoint(palm, flange, placement * pin.SE3(np.eye(3), np.array([0.0, 0.0, hand.body_z_m])))
    middle = (hand.bar_top_m + hand.bar_bottom_m) / 2
    bars = pin.Inertia.FromCylinder(4 * hand.bar_mass_kg, hand.open_m, hand.bar_bottom_m - hand.bar_top_m)
    model.appendBodyToJoint(palm, bars, placement * pin.SE3(np.eye(3), np.array([0.0, 0.0, middle])))
    return int(model.addFrame(pin.Frame(side + "Tool", palm, placement, pin.FrameType.OP_FRAME)))
