"""Grey pictures as JPEG and as lossy WebP, scaled, and what damaged ones are.

Pillow does the work; it is imported when a picture is coded, not when a link is built.
"""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

import numpy as np

from teleop_sim.channel.codec import BadMessage

if TYPE_CHECKING:
    from PIL.Image import Image as PillowImage

JPEG_SIDE_MAX = 65535
"""Sizes have 16 bits (ITU-T T.81, B.2.2)."""

WEBP_SIDE_MAX = 16383
"""Sizes have 14 bits (RFC 6386, 9.1)."""

WEBP_PIXELS_MAX = 1 << 24
"""Damage can make a header promise 268 million, for which libwebp takes 2 GB before it looks (assumed: 4096 x 4096)."""

JPEG_PIXELS_MAX = 89_478_485
"""Damage can make a header promise gigapixels. Pillow warns of bombs above this, a quarter of a GB in colour."""

_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
_JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_JPEG_FRAME = struct.Struct(">BHHB")
"""A frame's sample precision, lines, samples a line, components (ITU-T T.81, B.2.2). Other marks: tables (B.1.1.3)."""
_JPEG_SCAN, _JPEG_ALONE = 0xDA, frozenset({0x00, 0x01, *range(0xD0, 0xDA)})
_JPEG_BITS = 8
_JPEG_MODES = {1: "L", 3: "RGB", 4: "CMYK"}
_WEBP_HEAD = struct.Struct("<4sI4s4sI3s3sHH")
"""RIFF, its size, WEBP, VP8, its size; frame tag, start code, width and height (14 bits, and 2 of scale)."""


def grey_jpeg(pixels: np.ndarray, width: int, height: int, quality: int) -> bytes:
    """A grey JPEG of an image, scaled. The same pixels give the same bytes on one build of Pillow.

    Args:
        pixels: (h, w) grey or (h, w, 3) RGB, uint8.
        width: of the JPEG [px].
        height: of the JPEG [px].
        quality: 1 to 95, libjpeg's scale.

    Raises:
        BadMessage: pixels of another shape or type, or a size or quality out of range.

    """
    _refuse_odd("image", pixels, (width, height, quality), (JPEG_SIDE_MAX, 95))
    sink = io.BytesIO()
    _scaled_luma(pixels, width, height).save(sink, "JPEG", quality=quality, optimize=True)
    return sink.getvalue()


def jpeg_size(jpeg: bytes, where: str) -> tuple[int, int]:
    """Width and height [px] of a whole grey JPEG, without unpacking it.

    Source: ITU-T T.81, B.1.1 and B.2.

    Raises:
        BadMessage: the bytes are cut off or are no grey JPEG.

    """
    if not (jpeg.startswith(_JPEG_START) and jpeg.endswith(_JPEG_END)):
        raise BadMessage(where, f"{len(jpeg)} bytes are no whole JPEG", "Give a whole grey JPEG.")
    precision, height, width, parts = _jpeg_frame(jpeg)
    if precision != _JPEG_BITS or not 0 < width * height <= JPEG_PIXELS_MAX or parts not in _JPEG_MODES:
        raise BadMessage(where, f"{len(jpeg)} bytes are no sound JPEG: {width} x {height} px", "Send it again.")
    if parts != 1:
        raise BadMessage(where, f"a JPEG in mode {_JPEG_MODES[parts]}", "Give a whole grey JPEG.")
    return width, height


def _jpeg_frame(jpeg: bytes) -> tuple[int, int, int, int]:
    """Precision, height, width and components of the last frame before a scan; zeros if the head is none."""
    at, frame = len(_JPEG_START), (0, 0, 0, 0)
    while at + _JPEG_FRAME.size + 4 <= len(jpeg) and jpeg[at] == 0xFF:
        mark, size = jpeg[at + 1], int.from_bytes(jpeg[at + 2 : at + 4], "big")
        if mark == 0xFF:  # may stand before any mark
            at += 1
            continue
        if mark == _JPEG_SCAN:
            return frame
        if mark in _JPEG_ALONE or size < 2:
            break
        if mark in _JPEG_FRAMES:
            frame = _JPEG_FRAME.unpack_from(jpeg, at + 4)
        at += 2 + size
    return (0, 0, 0, 0)


def jpeg_pixels(jpeg: bytes, where: str) -> np.ndarray:
    """The pixels (h, w) uint8 of a grey JPEG.

    Raises:
        BadMessage: the bytes are damaged.

    """
    with _opened(jpeg, "JPEG", where) as picture:
        return np.asarray(picture)


def grey_webp(pixels: np.ndarray, width: int, height: int, quality: int) -> bytes:
    """A lossy WebP of an image's luma, scaled. The same pixels give the same bytes on one build of Pillow and libwebp.

    Args:
        pixels: (h, w) grey or (h, w, 3) RGB, uint8.
        width: of the WebP [px].
        height: of the WebP [px].
        quality: 0 to 100, libwebp's scale; method 6, its slowest and smallest.

    Raises:
        BadMessage: pixels of another shape or type, or a size or quality out of range.

    """
    _refuse_odd("webp_image", pixels, (width, height, quality + 1), (WEBP_SIDE_MAX, 101))
    sink = io.BytesIO()
    # WebP knows no grey: its two colour planes are flat and cost next to nothing.
    _scaled_luma(pixels, width, height).convert("RGB").save(sink, "WEBP", quality=quality, method=6)
    return sink.getvalue()


def webp_size(webp: bytes, where: str) -> tuple[int, int]:
    """Width and height [px] of a whole lossy WebP of one frame, without unpacking it.

    Source: RFC 9649, 2.4 and 2.5 (container), RFC 6386, 9.1 (frame header).

    Raises:
        BadMessage: the bytes are cut off or are no such WebP.

    """
    head = _WEBP_HEAD.unpack(webp[: _WEBP_HEAD.size]) if len(webp) >= _WEBP_HEAD.size else ()
    if not head or head[0] != b"RIFF" or head[2:4] != (b"WEBP", b"VP8 ") or head[6] != b"\x9d\x01\x2a":
        raise BadMessage(where, f"{len(webp)} bytes are no lossy WebP", "Use encode_webp.")
    riff, chunk, width, height = head[1], head[4], head[7] & 0x3FFF, head[8] & 0x3FFF
    if riff != len(webp) - 8 or chunk + chunk % 2 != len(webp) - 20 or not width * height:
        raise BadMessage(where, f"{len(webp)} bytes are no whole WebP", "Use encode_webp.")
    if width * height > WEBP_PIXELS_MAX:
        raise BadMessage(where, f"a WebP of {width} x {height} px", f"At most {WEBP_PIXELS_MAX} px are taken.")
    return width, height


def webp_pixels(webp: bytes, where: str) -> np.ndarray:
    """The luma (h, w) uint8 of a WebP.

    Raises:
        BadMessage: the bytes are damaged.

    """
    with _opened(webp, "WEBP", where) as picture:
        return np.asarray(picture.convert("L"))


def sample_picture(width: int, height: int) -> np.ndarray:
    """A picture (height, width, 3) uint8 that compresses somewhat like a scene: shades, edges, a wheel, clutter, grain.

    For examples and tables. Drawn by formula, so the same everywhere.
    """
    y, x = (v.astype(np.float64) for v in np.mgrid[0:height, 0:width])
    u, v = x / width, y / height
    shade = 90.0 + 90.0 * v + 40.0 * ((u * 7).astype(int) % 2) * (v > 0.55)
    radius = np.hypot((u - 0.45) * width / height, v - 0.5)
    shade = np.where(np.abs(radius - 0.25) < 0.03, 210.0 - 200.0 * v, shade)
    grey = shade + 50.0 * _scatter(np.floor(u * 60), np.floor(v * 32)) + 8.0 * _scatter(x, y)
    card: np.ndarray = np.clip(np.stack([grey, grey * 0.95, grey * 0.9], axis=-1), 0, 255).astype(np.uint8)
    return card


def _scatter(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Numbers from -0.5 to 0.5 as if at random: fract of a steep sine, so the same everywhere but for its last bits."""
    scatter: np.ndarray = (np.sin(x * 12.9898 + y * 78.233) * 43758.5) % 1.0 - 0.5
    return scatter


def _refuse_odd(where: str, pixels: np.ndarray, asked: tuple[int, int, int], most: tuple[int, int]) -> None:
    """Refuse pixels, sizes and qualities (from 1) that no coder takes."""
    (width, height, quality), (side, best) = asked, most
    if pixels.dtype != np.uint8 or not (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)):
        raise BadMessage(where, f"pixels {pixels.dtype} {pixels.shape}", "Give uint8 of (h, w) or (h, w, 3).")
    if pixels.size == 0 or not (0 < width <= side and 0 < height <= side and 1 <= quality <= best):
        hint = f"Give 1 to {side} px, and a quality on the coder's scale."
        raise BadMessage(where, f"{width} x {height} px at this quality cannot be sent", hint)


def _scaled_luma(pixels: np.ndarray, width: int, height: int) -> PillowImage:
    """Luma of ITU-R BT.601, Pillow's "L"; its bilinear filter averages when shrinking."""
    from PIL import Image

    return Image.fromarray(pixels).convert("L").resize((width, height), Image.Resampling.BILINEAR)


@contextmanager
def _opened(data: bytes, kind: Literal["JPEG", "WEBP"], where: str) -> Iterator[PillowImage]:
    """A picture in Pillow, with all that Pillow says about damaged bytes turned into ``BadMessage``."""
    from PIL import Image

    bombs = (Image.DecompressionBombWarning, Image.DecompressionBombError)
    try:
        with warnings.catch_warnings():
            # Damage can make a header promise gigapixels.
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=(kind,)) as picture:
                yield picture
    except BadMessage:
        raise
    except (EOFError, OSError, SyntaxError, ValueError, *bombs) as error:
        raise BadMessage(where, f"{len(data)} bytes are no sound {kind}: {error}", "Send it again.") from None
