"""NASA Valkyrie R5 as data: body, servos, shapes, gait, postures.

Links, joints, limits and inertias: ``valkyrie.json``, which names its source and licence. Masses agree with Table I of
the WPI paper.
"""

from __future__ import annotations

from pathlib import Path

from teleop_sim.robot.gait import Gait
from teleop_sim.robot.hand import CAGE, tool_in_palm
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.contact import Part
from teleop_sim.world.description import load_description, without
from teleop_sim.world.robot_model import HandMount, RobotModel, Servo, Shape

LEG = ("HipYaw", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ARM = ("ShoulderPitch", "ShoulderRoll", "ShoulderYaw", "ElbowPitch", "ForearmYaw", "WristRoll", "WristPitch")
TORSO = ("torsoYaw", "torsoPitch", "torsoRoll")
NECK = ("lowerNeckPitch", "neckYaw", "upperNeckPitch")

# Position servos (kp, kv, armature), measured in trials: soft legs, because inverse dynamics carries the robot and the
# servo only adds a residual; arms stiff enough to stream postures. None of them is published for the robot.
SERVOS = {
    "Ankle": (300.0, 19.0, 0.1),
    "Hip": (300.0, 31.6, 0.1),
    "Knee": (300.0, 31.6, 0.1),
    "torso": (3000.0, 100.0, 0.1),
    "Neck": (200.0, 10.0, 0.1),
    "neck": (200.0, 10.0, 0.1),
    "Shoulder": (800.0, 40.0, 0.1),
    "Elbow": (400.0, 20.0, 0.1),
    "Forearm": (200.0, 10.0, 0.02),
    "Wrist": (200.0, 6.0, 0.02),
}

# Arms bent and clear of the body, knees at 0.9 rad so that a 0.3 m step does not stretch a leg (measured: a hip-ankle
# distance above 0.988 of the straight leg falls).
KNEE_RAD = 0.9
WALK_POSTURE = {
    "rightShoulderPitch": -0.4,
    "rightShoulderRoll": 1.2,
    "rightElbowPitch": 1.4,
    "rightForearmYaw": 1.5,
    "leftShoulderPitch": -0.4,
    "leftShoulderRoll": -1.2,
    "leftElbowPitch": -1.4,
    "leftForearmYaw": 1.5,
    "lowerNeckPitch": 0.0,
    "upperNeckPitch": 0.0,
}


def _servo(joint: str) -> Servo:
    kp, kv, armature = next(gains for part, gains in SERVOS.items() if part in joint)
    return Servo(kp, kv, armature)


def _shapes() -> tuple[Shape, ...]:
    """Primitive shapes after link lengths; radii assumed."""
    shapes = [
        Shape("pelvis", "box", (0.0, 0.0, -0.1), (0.12, 0.14, 0.1)),
        Shape("torso", "box", (0.0, 0.0, 0.2), (0.14, 0.2, 0.22)),
        Shape("upperNeckPitchLink", "sphere", (0.08, 0.0, 0.05), radius_m=0.12),
    ]
    for side, y in (("left", 1.0), ("right", -1.0)):
        leg: Part = "left_leg" if side == "left" else "right_leg"
        arm: Part = "left_arm" if side == "left" else "right_arm"
        shapes += [
            Shape(f"{side}HipPitchLink", "capsule", (0.0, y * 0.05, -0.05), (0.0, y * 0.036, -0.38), 0.08, leg),
            Shape(f"{side}KneePitchLink", "capsule", (0.0, 0.0, 0.0), (-0.01, 0.0, -0.34), 0.06, leg),
            # The shoulder's end stays clear of the torso's box, whatever the arm does.
            Shape(f"{side}ShoulderYawLink", "capsule", (0.0, y * 0.09, 0.0), (0.0, y * 0.3, 0.0), 0.06, arm),
            Shape(f"{side}ForearmLink", "capsule", (0.0, y * 0.05, 0.0), (0.0, y * 0.22, 0.0), 0.05, arm),
        ]
    return tuple(shapes)


def valkyrie() -> RobotSpec:
    """Build the robot's data; fingers are folded into the palms, which carry cage hands."""
    description = without(load_description(Path(__file__).with_name("valkyrie.json")), r"(Thumb|Finger|Pinky)")
    hands = tuple(HandMount(side, f"{side}Palm", *tool_in_palm(side), CAGE) for side in ("left", "right"))
    return RobotSpec(
        model=RobotModel(
            description=description,
            servos={joint.name: _servo(joint.name) for joint in description.joints},
            shapes=_shapes(),
            hands=hands,
            trunk="torso",
        ),
        legs=(tuple(f"left{n}" for n in LEG), tuple(f"right{n}" for n in LEG)),
        arms={"left": tuple(f"left{n}" for n in ARM), "right": tuple(f"right{n}" for n in ARM)},
        torso=TORSO,
        neck=NECK,
        knee_rad=KNEE_RAD,
        postures={"walk": WALK_POSTURE},
        head_pitch=("lowerNeckPitch", "upperNeckPitch"),
        head_yaw="neckYaw",
        camera_frame="left_camera_frame",
        lidar_frame="head_hokuyo_frame",
        # WPI allows 0.3 m; over a bump the ankle of the leg behind then comes to its limit (docs/physics.md).
        gait=Gait(stride_m=0.27),
    )
