"""What people and the field site tell each other of templates at work: steps, views of a place, hands, plans.

A step is one act of the manipulation workflow of object templates (Romay et al., section 3.3): a behaviour's states and
people order the same ones.
"""

from __future__ import annotations

import struct
from typing import ClassVar, Literal, Self

from teleop_sim.channel.codec import BadMessage, pack_counts, unpack_counts
from teleop_sim.channel.command_messages import SIDES, Side
from teleop_sim.channel.message import UINT8_MAX, UINT16_MAX, Counts, Message, body_of, index_of, message
from teleop_sim.channel.quantise import GROUND, POSITION, ROTATION, Vector, pack_pose, unpack_pose

StepName = Literal[
    "stand", "pregrasp", "grasp", "open", "close", "attach", "detach", "usability", "affordance", "release", "home"
]
STEPS: tuple[StepName, ...] = (
    "stand", "pregrasp", "grasp", "open", "close", "attach", "detach", "usability", "affordance", "release", "home",
)  # fmt: skip

OutcomeName = Literal[
    "reached", "taken", "closed", "opened", "released", "blocked", "no_plan", "no_motion", "grip_lost", "force_limit",
    "timed_out", "fell", "stopped", "refused",
]  # fmt: skip
OUTCOMES: tuple[OutcomeName, ...] = (
    "reached", "taken", "closed", "opened", "released", "blocked", "no_plan", "no_motion", "grip_lost", "force_limit",
    "timed_out", "fell", "stopped", "refused",
)  # fmt: skip

AMOUNT_STEP = 0.001
"""Of amounts: 1 mm or 1 mrad (assumed: finer than any hand)."""
_AMOUNT = struct.Struct(">h")
_MAX_FOOTSTEPS = 255
_FOOTSTEP_BYTES = 6
_POSE = "1 mm up to ±32.767 m; 96 µrad up to ±pi"


@message("up", "template_step", b"\xa6")
class TemplateStep(Message):
    """The operator orders a step of the workflow with a template that lies there.

    Attributes:
        step: which.
        instance: of the template.
        side: of the hand.
        which: id of the affordance, grasp, pre-grasp, stand or usability in the library.
        amount: of an affordance [m or rad], sent to a thousandth, at most ±32.767; zero: what the template says.

    """

    layout: ClassVar = "type, step, instance, side, which (2), amount (2)"
    resolution: ClassVar = "1 mm or 1 mrad"

    step: StepName
    instance: int
    side: Side
    which: int
    amount: float = 0.0

    @classmethod
    def example(cls) -> Self:
        """Turn a lever by 55 degrees."""
        return cls("affordance", 0, "left", 0, 0.96)

    def encode(self) -> bytes:
        """Type, step, instance, side, which, amount."""
        numbers = (index_of(self.step, STEPS, self.topic), self.instance, index_of(self.side, SIDES, self.topic))
        head = pack_counts((*numbers, self.which), (len(STEPS) - 1, UINT8_MAX, len(SIDES) - 1, UINT16_MAX), self.topic)
        return self.marks + head + _pack_amount(self.amount, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        limits = (len(STEPS) - 1, UINT8_MAX, len(SIDES) - 1, UINT16_MAX)
        step, instance, side, which = unpack_counts(body[:5], limits, cls.topic)
        return cls(STEPS[step], instance, SIDES[side], which, _unpack_amount(body[5:], cls.topic))


@message("down", "step_done", b"\xb2")
class StepDone(Message):
    """What came of a step, ordered by a person or by the behaviour.

    Attributes:
        step: which.
        outcome: of the last movement.
        amount: how far an affordance went, as felt [m or rad], sent to a thousandth.

    """

    layout: ClassVar = "type, step, outcome, amount (2)"
    resolution: ClassVar = "1 mm or 1 mrad"

    step: StepName
    outcome: OutcomeName
    amount: float = 0.0

    @classmethod
    def example(cls) -> Self:
        """A lever turned."""
        return cls("affordance", "reached", 0.96)

    def encode(self) -> bytes:
        """Type, step, outcome, amount."""
        numbers = (index_of(self.step, STEPS, self.topic), index_of(self.outcome, OUTCOMES, self.topic))
        head = pack_counts(numbers, (len(STEPS) - 1, len(OUTCOMES) - 1), self.topic)
        return self.marks + head + _pack_amount(self.amount, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        step, outcome = unpack_counts(body[:2], (len(STEPS) - 1, len(OUTCOMES) - 1), cls.topic)
        return cls(STEPS[step], OUTCOMES[outcome], _unpack_amount(body[2:], cls.topic))


@message("up", "ask_cloud", b"\xa7")
class AskCloud(Message):
    """The operator wants the cloud of a region as it is now: a scan when the robot has come to rest.

    Attributes:
        voxel_mm: edge of a voxel [mm].
        middle_m: (3,) of the region, odometry frame, sent to 1 mm.
        radius_m: of the ball, sent to 1 cm, at most 2.55 m.

    """

    layout: ClassVar = "type, voxel size (2), middle (6), radius"
    resolution: ClassVar = "1 mm; radius 1 cm"

    voxel_mm: int
    middle_m: Vector
    radius_m: float

    @classmethod
    def example(cls) -> Self:
        """A valve."""
        return cls(20, (1.2, 0.3, 1.1), 0.5)

    def encode(self) -> bytes:
        """Type, voxel size, middle, radius."""
        radius = round(100.0 * self.radius_m)
        middle = POSITION.pack(self.middle_m, self.topic)
        return (
            self.marks
            + pack_counts((self.voxel_mm,), (UINT16_MAX,), self.topic)
            + middle
            + pack_counts((radius,), (UINT8_MAX,), self.topic)
        )

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        (voxel_mm,) = unpack_counts(body[:2], (UINT16_MAX,), cls.topic)
        x, y, z = POSITION.unpack(body[2:8], 3, cls.topic)
        (radius,) = unpack_counts(body[8:], (UINT8_MAX,), cls.topic)
        return cls(voxel_mm, (x, y, z), 0.01 * radius)


@message("up", "reset_world", b"\xa8")
class ResetWorld(Counts):
    """The operator has the world model forget everything seen so far, real and spurious."""

    layout: ClassVar = "type"


@message("down", "hand_pose", b"\xb3")
class HandPose(Message):
    """Where a hand's tool is, in the odometry frame, by the robot's own joints.

    Attributes:
        side: of the hand.
        position_m: (3,), sent to 1 mm, at most ±32.767 m.
        rotation_rad: rotation vector (3,), sent to pi/32767 a component.

    """

    layout: ClassVar = "type, side, position (6), rotation vector (6)"
    resolution: ClassVar = _POSE

    side: Side
    position_m: Vector
    rotation_rad: Vector

    @classmethod
    def example(cls) -> Self:
        """The left hand at a lever."""
        return cls("left", (0.7, 0.2, 1.0), (0.0, 1.5, 0.0))

    def encode(self) -> bytes:
        """Type, side, pose."""
        side = index_of(self.side, SIDES, self.topic)
        return self.marks + bytes([side]) + pack_pose(self.position_m, self.rotation_rad, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        (side,) = unpack_counts(body[:1], (len(SIDES) - 1,), cls.topic)
        return cls(SIDES[side], *unpack_pose(body[1:], cls.topic))


Planar = tuple[float, float, float]


@message("down", "footstep_plan", b"\xb4")
class FootstepPlan(Message):
    """Footsteps that are planned, or a part of them, for a person to check.

    Attributes:
        part: number of this part, from 0; parts: how many there are.
        steps: x [m], y [m], yaw [rad] of each, odometry frame, sent to 5 mm and 96 µrad.

    """

    layout: ClassVar = "type, part, parts, then for each step: x (2), y (2), yaw (2)"
    resolution: ClassVar = "5 mm up to ±163.835 m; 96 µrad up to ±pi"

    part: int
    parts: int
    steps: tuple[Planar, ...]

    @classmethod
    def example(cls) -> Self:
        """Ten steps ahead."""
        return cls(0, 1, tuple((0.2 * k, 0.1 * (-1) ** k, 0.0) for k in range(10)))

    def encode(self) -> bytes:
        """Type, part, parts, steps."""
        if not self.part < self.parts or len(self.steps) > _MAX_FOOTSTEPS:
            came = f"part {self.part} of {self.parts} with {len(self.steps)} steps"
            raise BadMessage(
                self.topic, came, f"Give a part below the number of parts, at most {_MAX_FOOTSTEPS} steps."
            )
        head = pack_counts((self.part, self.parts), (UINT8_MAX, UINT8_MAX), self.topic)
        steps = (GROUND.pack(s[:2], self.topic) + ROTATION.pack(s[2:], self.topic) for s in self.steps)
        return self.marks + head + b"".join(steps)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        part, parts = unpack_counts(body[:2], (UINT8_MAX, UINT8_MAX), cls.topic)
        rest = body[2:]
        if len(rest) % _FOOTSTEP_BYTES or part >= parts:
            raise BadMessage(cls.topic, f"{len(payload)} bytes", f"Steps have {_FOOTSTEP_BYTES} bytes each.")
        pieces = [rest[k : k + _FOOTSTEP_BYTES] for k in range(0, len(rest), _FOOTSTEP_BYTES)]
        return cls(part, parts, tuple(_unpack_footstep(p, cls.topic) for p in pieces))


def _unpack_footstep(data: bytes, where: str) -> Planar:
    x_m, y_m = GROUND.unpack(data[:4], 2, where)
    (yaw_rad,) = ROTATION.unpack(data[4:], 1, where)
    return x_m, y_m, yaw_rad


def _pack_amount(amount: float, where: str) -> bytes:
    try:
        return _AMOUNT.pack(round(amount / AMOUNT_STEP))
    except (struct.error, ValueError, OverflowError):
        raise BadMessage(where, f"an amount of {amount}", "Give a number within ±32.767.") from None


def _unpack_amount(data: bytes, where: str) -> float:
    if len(data) != _AMOUNT.size:
        raise BadMessage(where, f"{len(data)} bytes for an amount", f"It has {_AMOUNT.size}.")
    return float(_AMOUNT.unpack(data)[0]) * AMOUNT_STEP
