"""Boston Dynamics Atlas v5 as data: body, servos, shapes, gait, postures.

Links, joints, limits and inertias: ``atlas.json``, which names its sources and licences. Masses agree with Table I of
the WPI paper but for the head, which the public model makes lighter. The left arm's frames are turned half round and
its axes negated: signs of left and right angles follow no rule.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from teleop_sim.robot.gait import Gait
from teleop_sim.robot.hand import CAGE
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.contact import Part
from teleop_sim.world.description import load_description, without
from teleop_sim.world.robot_model import HandMount, RobotModel, Servo, Shape

LEG = ("hpz", "hpx", "hpy", "kny", "aky", "akx")
ARM = ("shz", "shx", "ely", "elx", "uwy", "mwx", "lwy")
TORSO = ("back_bkz", "back_bky", "back_bkx")

# Position servos (kp, kv, armature), measured in trials: soft legs as Valkyrie's, a stiff upper body. None of them is
# published for the robot.
SERVOS = {
    "aky": (300.0, 19.0, 0.3),
    "akx": (300.0, 19.0, 0.3),
    "_leg_": (300.0, 30.0, 0.3),
    "back": (3000.0, 150.0, 0.2),
    "neck": (250.0, 20.0, 0.03),
    "uwy": (250.0, 20.0, 0.03),
    "mwx": (250.0, 20.0, 0.03),
    "lwy": (250.0, 20.0, 0.03),
    "_arm_": (900.0, 60.0, 0.1),
}

# Knees at 1 rad (measured).
KNEE_RAD = 1.0
# Elbows out, hands tucked up before the chest: what no part of an arm hangs down to is no obstacle to it, such as a
# console of 0.97 m with its handles (hands as low as that, 0.57 m ahead, could not be walked up to it; measured).
WALK_POSTURE = {
    "l_arm_shz": 0.2,
    "r_arm_shz": -0.2,
    "l_arm_shx": -0.8,
    "r_arm_shx": 0.8,
    "l_arm_ely": 1.6,
    "r_arm_ely": 1.6,
    "l_arm_elx": 2.1,
    "r_arm_elx": -2.1,
}

TOOL_M = 0.275
"""From the wrist to the middle of the cage, along -y of the hand: on the gripper's face (assumed)."""


def _servo(joint: str) -> Servo:
    kp, kv, armature = next(gains for part, gains in SERVOS.items() if part in joint)
    return Servo(kp, kv, armature)


def _shapes() -> tuple[Shape, ...]:
    """Primitive shapes after the published collision boxes and cylinders and link lengths; rounded."""
    shapes = [
        Shape("pelvis", "box", (-0.02, 0.0, 0.02), (0.14, 0.09, 0.1)),
        Shape("utorso", "box", (-0.08, 0.0, 0.36), (0.2, 0.17, 0.34)),
        Shape("head", "sphere", (-0.03, 0.0, 0.03), radius_m=0.13),
    ]
    for side in ("left", "right"):
        leg: Part = "left_leg" if side == "left" else "right_leg"
        arm: Part = "left_arm" if side == "left" else "right_arm"
        s = side[0]
        shapes += [
            Shape(f"{s}_uleg", "capsule", (-0.02, 0.0, -0.08), (-0.045, 0.0, -0.3), 0.08, leg),
            Shape(f"{s}_lleg", "capsule", (0.01, 0.0, -0.05), (0.0, 0.0, -0.34), 0.065, leg),
            Shape(f"{s}_uarm", "capsule", (0.0, 0.03, 0.0), (0.0, -0.11, 0.0), 0.06, arm),
            Shape(f"{s}_larm", "capsule", (0.0, -0.03, 0.0), (0.0, -0.2, 0.0), 0.055, arm),
            Shape(f"{s}_ufarm", "capsule", (0.0, 0.12, 0.0), (0.0, 0.0, 0.0), 0.05, arm),
        ]
    return tuple(shapes)


def _hand(side: str) -> HandMount:
    rotation = np.column_stack([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    return HandMount(side, f"{side[0]}_hand", np.array([0.0, -TOOL_M, 0.0]), rotation, CAGE)


def atlas() -> RobotSpec:
    """Build the robot's data; fingers are folded into the hands, which carry Valkyrie's cages."""
    description = without(load_description(Path(__file__).with_name("atlas.json")), r"_finger_")
    return RobotSpec(
        model=RobotModel(
            description=description,
            servos={joint.name: _servo(joint.name) for joint in description.joints},
            shapes=_shapes(),
            hands=(_hand("left"), _hand("right")),
            trunk="utorso",
        ),
        legs=(tuple(f"l_leg_{n}" for n in LEG), tuple(f"r_leg_{n}" for n in LEG)),
        arms={"left": tuple(f"l_arm_{n}" for n in ARM), "right": tuple(f"r_arm_{n}" for n in ARM)},
        torso=TORSO,
        neck=("neck_ay",),
        knee_rad=KNEE_RAD,
        postures={"walk": WALK_POSTURE},
        head_pitch=("neck_ay",),
        head_yaw=None,
        camera_frame="left_camera_frame",
        lidar_frame="head_hokuyo_frame",
        # With 0.7 s between two steps the leg behind is straight before it is lifted: 5 of 8 walks fell (measured).
        gait=Gait(transfer_s=0.3, stride_m=0.25, width_m=0.23, turn_rad=0.5),
    )
