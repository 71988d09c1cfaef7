"""ROBOTIS THORMANG3 as data: body, servos, shapes, gait, postures.

Links, joints, limits and inertias: ``thormang3.json``, which names its sources and licence; torque limits are those of
the Dynamixel motors that drive the joints, as the published model has placeholders. The pitch axes of arms and legs are
mirrored, so left and right angles have opposite signs.

The robot is at its limits: standing on one leg with the pelvis level takes 47 N m of a hip's roll, and the motor gives
44.7. So the pelvis leans over the standing foot, and steps are short. A bent knee takes all of its motor with the load
over the ankle: so the load is planned ahead of it (30 of 60 disturbed walks arrived without, see docs/physics.md).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from teleop_sim.robot.gait import Gait
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.cage import CageHand
from teleop_sim.world.contact import Part
from teleop_sim.world.description import load_description, without
from teleop_sim.world.robot_model import HandMount, RobotModel, Servo, Shape

LEG = ("hip_y", "hip_r", "hip_p", "kn_p", "an_p", "an_r")
ARM = ("sh_p1", "sh_r", "sh_p2", "el_y", "wr_r", "wr_y", "wr_p")

# Position servos (kp, kv, armature), measured in trials. None of them is published for the robot.
SERVOS = {
    "_an_": (100.0, 5.0, 0.045),
    "_leg_": (100.0, 8.0, 0.045),
    "_wr_": (50.0, 4.0, 0.01),
    "head": (50.0, 4.0, 0.01),
    "": (250.0, 20.0, 0.025),
}

# Knees as bent as carries the robot over a 1 cm bump (measured).
KNEE_RAD = 0.7
# Elbows out at the shoulders' height, forearms ahead: no part of an arm is lower than a console's handles, so that it
# can walk up to them. Ahead, because the knees are at their limit: with its hands drawn back beside the trunk, which
# moves the pelvis ahead by 4 cm, 42 of 60 walks fell, 2 so (measured).
WALK_POSTURE = {"l_arm_sh_p1": -0.1, "r_arm_sh_p1": 0.1, "l_arm_el_y": 0.35, "r_arm_el_y": -0.35}

CAGE = CageHand(body_mass_kg=0.02, bar_mass_kg=0.002, armature_kg=0.05)
"""As light as the gripper's two jaws that it stands for."""

TOOL_M = 0.145
"""From the wrist to the middle of the cage, along x of the last link: where the published model has its hand's end
(``l_arm_end_link`` of thormang3.json). Further out the wrist, 5.1 N m, would hold less."""


def _servo(joint: str) -> Servo:
    kp, kv, armature = next(gains for part, gains in SERVOS.items() if part in joint)
    return Servo(kp, kv, armature, damping=0.2)


def _shapes() -> tuple[Shape, ...]:
    """Primitive shapes after the published collision boxes; limbs as capsules within them."""
    shapes = [
        Shape("pelvis_link", "box", (-0.01, 0.0, 0.07), (0.1, 0.1, 0.085)),
        Shape("chest_link", "box", (-0.01, 0.0, 0.11), (0.1, 0.125, 0.115)),
        Shape("head_p_link", "sphere", (0.01, 0.045, 0.06), radius_m=0.08),
    ]
    for side, y in (("left", 1.0), ("right", -1.0)):
        leg: Part = "left_leg" if side == "left" else "right_leg"
        arm: Part = "left_arm" if side == "left" else "right_arm"
        s = side[0]
        shapes += [
            Shape(f"{s}_leg_hip_p_link", "capsule", (0.0, 0.0, -0.04), (0.0, y * 0.03, -0.26), 0.055, leg),
            Shape(f"{s}_leg_kn_p_link", "capsule", (0.01, y * -0.065, -0.03), (0.01, y * -0.065, -0.25), 0.055, leg),
            Shape(f"{s}_arm_sh_p2_link", "capsule", (0.01, y * 0.06, 0.0), (0.01, y * 0.18, 0.0), 0.05, arm),
            Shape(f"{s}_arm_el_y_link", "capsule", (0.02, y * 0.01, -0.057), (0.15, y * 0.01, -0.057), 0.042, arm),
            Shape(f"{s}_arm_wr_r_link", "capsule", (0.0, 0.0, 0.0), (0.04, 0.0, 0.0), 0.03, arm),
        ]
    return tuple(shapes)


def _hand(side: str) -> HandMount:
    y = 1.0 if side == "left" else -1.0
    rotation = np.column_stack([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    return HandMount(side, f"{side[0]}_arm_wr_p_link", np.array([TOOL_M, 0.045 * y, 0.0]), rotation, CAGE)


def thormang3() -> RobotSpec:
    """Build the robot's data; the jaws of its grippers are folded into the wrists, which carry light cages."""
    description = without(load_description(Path(__file__).with_name("thormang3.json")), r"_grip(_1)?_link$")
    return RobotSpec(
        model=RobotModel(
            description=description,
            servos={joint.name: _servo(joint.name) for joint in description.joints},
            shapes=_shapes(),
            hands=(_hand("left"), _hand("right")),
            trunk="chest_link",
        ),
        legs=(tuple(f"l_leg_{n}" for n in LEG), tuple(f"r_leg_{n}" for n in LEG)),
        arms={"left": tuple(f"l_arm_{n}" for n in ARM), "right": tuple(f"r_arm_{n}" for n in ARM)},
        torso=("torso_y",),
        neck=("head_y", "head_p"),
        knee_rad=KNEE_RAD,
        postures={"walk": WALK_POSTURE},
        head_pitch=("head_p",),
        head_yaw="head_y",
        camera_frame="realsense_link",
        lidar_frame="lidar_link",
        gait=Gait(
            swing_s=0.7,
            transfer_s=0.3,
            lift_m=0.04,
            stride_m=0.1,
            back_stride_m=0.08,
            side_m=0.06,
            turn_rad=0.35,
            turn_walking_rad=0.1,
            width_m=0.2,
            first_s=0.6,
            lean_rad=0.15,
            zmp_ahead_m=0.035,
        ),
        # A hand that pushes 20 N twists the body by 8 N m: with the usual figures the hips' pitch is at its 44.7 N m.
        gains={"stance_damping": 10.0, "twist_m2": 0.03, "heading_error_rad": 0.5},
    )
