"""What the field site can show to the operator: pictures and clouds of voxels."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

import numpy as np

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.message import UINT16_MAX, Message, body_of, message
from teleop_sim.channel.pictures import (
    grey_jpeg,
    grey_webp,
    jpeg_pixels,
    jpeg_size,
    sample_picture,
    webp_pixels,
    webp_size,
)
from teleop_sim.channel.voxels import (
    DEPTH_MAX,
    deflate,
    depth_of,
    inflate,
    octree_bytes,
    octree_cells,
    sample_points,
    voxel_indices,
)

_CLOUD_HEAD = struct.Struct(">HhhhB")


class Coder(NamedTuple):
    """How pictures of a format are made and read; see ``pictures.py``."""

    name: str
    maker: str
    code: Callable[[np.ndarray, int, int, int], bytes]
    size: Callable[[bytes, str], tuple[int, int]]
    pixels: Callable[[bytes, str], np.ndarray]


@dataclass(frozen=True)
class Picture(Message):
    """A grey picture [px]. Sent as a type byte and the coded picture, which carries its own size.

    Attributes:
        width: of the picture [px].
        height: of the picture [px].
        coded: the picture in the format of its kind.

    """

    coder: ClassVar[Coder]
    resolution: ClassVar = "lossy"
    packed: ClassVar = True

    width: int
    height: int
    coded: bytes

    @classmethod
    def example(cls) -> Self:
        """A quarter of a video frame, at a quality that shows handles (50, on the coder's own scale)."""
        return cls(320, 170, cls.coder.code(sample_picture(320, 170), 320, 170, 50))

    def __post_init__(self) -> None:
        """Refuse what would not decode to the same.

        Raises:
            BadMessage: no whole grey picture of this format and size.

        """
        if self.coder.size(self.coded, self.topic) != (self.width, self.height):
            came = f"the {self.coder.name} is not {self.width} x {self.height} px"
            raise BadMessage(self.topic, came, f"Use {self.coder.maker}.")

    def encode(self) -> bytes:
        """The type byte and the coded picture."""
        return self.marks + self.coded

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        coded = body_of(cls, payload)
        return cls(*cls.coder.size(coded, cls.topic), coded)

    def pixels(self) -> np.ndarray:
        """What the receiver sees, (height, width) uint8.

        Raises:
            BadMessage: a damaged picture.

        """
        return self.coder.pixels(self.coded, self.topic)


@message("down", "image", b"\x14")
class Image(Picture):
    """A grey picture [px]. Sent as a type byte and the JPEG, which carries its own size."""

    coder: ClassVar = Coder("JPEG", "encode_image", grey_jpeg, jpeg_size, jpeg_pixels)
    layout: ClassVar = "type, grey JPEG"
    source: ClassVar = "ITU-T T.81"


@message("down", "webp_image", b"\x19")
class WebpImage(Picture):
    """A grey picture [px] in the younger format. Sent as a type byte and the WebP, which carries its own size."""

    coder: ClassVar = Coder("WebP", "encode_webp", grey_webp, webp_size, webp_pixels)
    layout: ClassVar = "type, lossy WebP of grey"
    source: ClassVar = "RFC 9649, RFC 6386"


def encode_image(pixels: np.ndarray, width: int, height: int, quality: int) -> Image:
    """Compress an image, (h, w) or (h, w, 3) uint8, to a grey picture of ``width`` x ``height`` px; see ``grey_jpeg``.

    Raises:
        BadMessage: pixels of another shape or type, or a size or quality out of range.

    """
    return Image(width, height, grey_jpeg(pixels, width, height, quality))


def encode_webp(pixels: np.ndarray, width: int, height: int, quality: int) -> WebpImage:
    """Compress an image, (h, w) or (h, w, 3) uint8, to a grey picture of ``width`` x ``height`` px; see ``grey_webp``.

    Raises:
        BadMessage: pixels of another shape or type, or a size or quality out of range.

    """
    return WebpImage(width, height, grey_webp(pixels, width, height, quality))


@message("down", "voxel_cloud", b"\x18")
class VoxelCloud(Message):
    """Which voxels hold something. Make one with ``encode_voxels``.

    The grid is the frame's own: voxel ``k`` spans ``k`` to ``k + 1`` voxel sizes, so that centres come back exactly.

    Attributes:
        voxel_mm: edge of a voxel [mm], 1 to 65535.
        origin: (3,) voxel at the octree's corner, 16 bits each.
        depth: levels of the octree, 0 (an empty cloud) to 16.
        octree: its occupancy, breadth first and packed, see ``voxels.py``.

    """

    layout: ClassVar = "type, voxel size (2), origin 3 × 2, depth, packed octree"
    resolution: ClassVar = "a voxel, whole millimetres"
    source: ClassVar = "Meagher 1982; Schnabel and Klein 2006"
    packed: ClassVar = True

    voxel_mm: int
    origin: tuple[int, int, int]
    depth: int
    octree: bytes

    @classmethod
    def example(cls) -> Self:
        """A console at 2 cm."""
        made = encode_voxels(sample_points(), 0.02)
        return cls(made.voxel_mm, made.origin, made.depth, made.octree)

    def __post_init__(self) -> None:
        """Refuse what could not be encoded or read.

        Raises:
            BadMessage: a field out of range, or bytes that are no octree.

        """
        self.encode()
        self._cells()

    def encode(self) -> bytes:
        """Type, head, octree."""
        if not 1 <= self.voxel_mm <= UINT16_MAX or not 0 <= self.depth <= DEPTH_MAX:
            came = f"voxels of {self.voxel_mm} mm in {self.depth} levels"
            raise BadMessage(self.topic, came, f"Give 1 to {UINT16_MAX} mm, at most {DEPTH_MAX} levels.")
        try:
            head = _CLOUD_HEAD.pack(self.voxel_mm, *self.origin, self.depth)
        except struct.error:
            came = f"{self.voxel_mm} mm, origin {self.origin}, depth {self.depth}"
            raise BadMessage(self.topic, came, "Give whole numbers, and an origin of three within ±32767.") from None
        return self.marks + head + self.octree

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        body = body_of(cls, payload)
        if len(body) < _CLOUD_HEAD.size:
            raise BadMessage(cls.topic, f"{len(payload)} bytes", "10 come before the octree.")
        voxel_mm, x, y, z, depth = _CLOUD_HEAD.unpack(body[: _CLOUD_HEAD.size])
        return cls(voxel_mm, (x, y, z), depth, body[_CLOUD_HEAD.size :])

    @property
    def voxel_m(self) -> float:
        """Edge of a voxel [m]."""
        return self.voxel_mm / 1000

    def centres_m(self) -> np.ndarray:
        """Centres of the voxels (v, 3) [m], in the octree's order."""
        centres: np.ndarray = (self._cells() + np.array(self.origin) + 0.5) * self.voxel_m
        return centres

    def _cells(self) -> np.ndarray:
        return octree_cells(inflate(self.octree, self.topic), self.depth, self.topic)


def encode_voxels(points_m: np.ndarray, voxel_m: float) -> VoxelCloud:
    """The voxels that hold points (n, 3) [m]; their edge is a whole number of millimetres.

    Raises:
        BadMessage: points of another shape or not finite, a voxel size that cannot be sent, or a cloud too long for 16
            levels or too far away for its origin.

    """
    voxel_mm = round(voxel_m * 1000) if 0 < voxel_m <= 65.535 else 0
    # Whole to a picometre: 0.07 * 1000 is no whole float.
    if voxel_mm == 0 or abs(voxel_m * 1000 - voxel_mm) > 1e-9:
        raise BadMessage(VoxelCloud.topic, f"voxels of {voxel_m!r} m", "Give whole millimetres, 1 to 65535.")
    cells = voxel_indices(points_m, voxel_mm / 1000)
    corner = cells.min(axis=0) if len(cells) else np.zeros(3, np.int64)
    depth = depth_of(cells - corner)
    if depth > DEPTH_MAX:
        hint = "Cut it, or take larger voxels."
        raise BadMessage(VoxelCloud.topic, f"a cloud of more than 65536 voxels of {voxel_m} m", hint)
    x, y, z = (int(k) for k in corner)
    return VoxelCloud(voxel_mm, (x, y, z), depth, deflate(octree_bytes(cells - corner, depth)))
