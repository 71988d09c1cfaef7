"""What the LIDAR sees of the robot's own hand: shows people whether the hand is where the robot believes it to be."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.command_messages import SIDES, Side
from teleop_sim.channel.message import Message, body_of, index_of, message
from teleop_sim.channel.picture_messages import VoxelCloud, encode_voxels
from teleop_sim.channel.quantise import POSITION, Vector
from teleop_sim.channel.voxels import sample_points

_HEAD_BYTES = 1 + 6


@message("down", "hand_cloud", b"\xb5")
class HandCloud(Message):
    """The points that the LIDAR has on one of the robot's hands. Make one with ``encode_hand``.

    Attributes:
        side: of the hand.
        expected_m: (3,) middle of the voxels that the robot's own model would fill, joints and mounting as believed and
            noise as usual: odometry frame, sent to 1 mm.
        voxels: that are filled, in the same frame.

    """

    layout: ClassVar = (
        "type, side, middle expected (6), then as of a voxel cloud: voxel size (2), origin 3 × 2, depth, packed octree"
    )
    resolution: ClassVar = "1 mm; a voxel, whole millimetres"
    packed: ClassVar = True

    side: Side
    expected_m: Vector
    voxels: VoxelCloud

    @classmethod
    def example(cls) -> Self:
        """As many voxels of 2 cm as a hand has: a corner of the console."""
        points = sample_points()
        return cls("left", (0.7, 0.2, 1.0), encode_voxels(points[points[:, 0] < np.quantile(points[:, 0], 0.05)], 0.02))

    def encode(self) -> bytes:
        """Type, side, middle, cloud."""
        side = index_of(self.side, SIDES, self.topic)
        return self.marks + bytes([side]) + POSITION.pack(self.expected_m, self.topic) + self.voxels.encode()[1:]

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``, to the resolution stated above."""
        body = body_of(cls, payload)
        if len(body) < _HEAD_BYTES or body[0] >= len(SIDES):
            raise BadMessage(cls.topic, f"{len(payload)} bytes", "A side and a middle come before the cloud.")
        x, y, z = POSITION.unpack(body[1:_HEAD_BYTES], 3, cls.topic)
        return cls(SIDES[body[0]], (x, y, z), VoxelCloud.decode(VoxelCloud.marks + body[_HEAD_BYTES:]))

    def offset_m(self) -> Vector:
        """(3,) how far the hand is seen from where the model has it [m]."""
        x, y, z = (float(v) for v in self.voxels.centres_m().mean(axis=0) - np.array(self.expected_m))
        return x, y, z


def encode_hand(side: Side, seen_m: np.ndarray, models_m: np.ndarray, voxel_m: float) -> HandCloud | None:
    """What is told of the points on a hand; None: there are none, or none are expected.

    All are taken for the voxels that they fill, so that a middle is not drawn to where rays are dense.

    Args:
        side: of the hand.
        seen_m: (n, 3) [m].
        models_m: (k, m, 3) that a model expects, k times with noise of their own [m].
        voxel_m: edge of a voxel.

    Raises:
        BadMessage: as ``encode_voxels``.

    """
    if not seen_m.size or not models_m.size:
        return None
    middles = [encode_voxels(model, voxel_m).centres_m().mean(axis=0) for model in models_m]
    x, y, z = (float(v) for v in np.mean(middles, axis=0))
    return HandCloud(side, (x, y, z), encode_voxels(seen_m, voxel_m))
