"""How values become bytes: small whole numbers, text lines, quantised poses, grey JPEG images.

Nothing here knows what a message means; ``messages.py`` does. Numbers are big-endian.
"""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from teleop_sim.core.errors import TeleopError

if TYPE_CHECKING:
    from PIL.Image import Image as PillowImage

POSITION_STEP_M = 0.001
"""Resolution of a sent position; 16 bits reach ±32.767 m (assumed: a tenth of a detector's error)."""

ROTATION_STEP_RAD = math.pi / 32767
"""Resolution of a component of a sent rotation vector; 16 bits reach ±pi, 96 µrad a step."""

_CODE_MAX = 32767
_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"


class BadMessage(TeleopError, ValueError):
    """A message that cannot be encoded, or bytes and text that are none.

    Attributes (in ``args``): ``where`` (which message or field), ``what`` (came), ``hint`` (what would do).
    """

    def __init__(self, where: str, what: str, hint: str = "") -> None:
        super().__init__(where, what, hint)

    def __str__(self) -> str:
        where, what, hint = self.args
        return f"{where}: {what}" + (f"\n  {hint}" if hint else "")


def pack_counts(values: Sequence[int], limits: Sequence[int], where: str) -> bytes:
    """Whole numbers from 0 to their limit, each in one byte, or in two where the limit needs it.

    Raises:
        BadMessage: a value that is no whole number or is out of range.

    """
    for value, limit in zip(values, limits, strict=True):
        if not isinstance(value, int) or not 0 <= value <= limit:
            raise BadMessage(where, f"{value!r} cannot be sent", f"Give a whole number from 0 to {limit}.")
    return b"".join(v.to_bytes(_width(limit), "big") for v, limit in zip(values, limits, strict=True))


def unpack_counts(data: bytes, limits: Sequence[int], where: str) -> tuple[int, ...]:
    """Inverse of ``pack_counts``.

    Raises:
        BadMessage: too few or too many bytes, or a value above its limit.

    """
    widths = [_width(limit) for limit in limits]
    if len(data) != sum(widths):
        raise BadMessage(where, f"{len(data)} bytes after the type byte", f"It has {sum(widths)}.")
    values: list[int] = []
    at = 0
    for width, limit in zip(widths, limits, strict=True):
        values.append(int.from_bytes(data[at : at + width], "big"))
        at += width
        if values[-1] > limit:
            raise BadMessage(where, f"value {values[-1]} in {data.hex()}", f"At most {limit} is possible.")
    return tuple(values)


def _width(limit: int) -> int:
    return 1 if limit < 256 else 2


def line_bytes(text: str, encoding: str, where: str) -> bytes:
    """One line of text without its end as bytes.

    Raises:
        BadMessage: the text is empty, holds a line end, or has characters outside ``encoding``.

    """
    if not text or "\n" in text or "\r" in text:
        raise BadMessage(where, f"{text!r} is not one line of text", "Give some text without line ends.")
    try:
        return text.encode(encoding)
    except UnicodeEncodeError as error:
        raise BadMessage(where, f"{text!r} cannot be written as {encoding}", str(error)) from None


def line_text(data: bytes, encoding: str, where: str) -> str:
    """Inverse of ``line_bytes``.

    Raises:
        BadMessage: the bytes are not one line in ``encoding``.

    """
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        raise BadMessage(where, f"bytes {data.hex()} are not {encoding} text", str(error)) from None
    line_bytes(text, encoding, where)
    return text


def pack_pose(position_m: Sequence[float], rotation_rad: Sequence[float], where: str) -> bytes:
    """Position (3,) [m] and rotation vector (3,) [rad] in 12 bytes, rounded to the nearest step.

    Raises:
        BadMessage: a number that is not finite or out of range, or not three of each.

    """
    if len(position_m) != 3 or len(rotation_rad) != 3:
        raise BadMessage(where, "a pose has 3 + 3 numbers", "Give a position and a rotation vector.")
    codes = [_code(v, POSITION_STEP_M, "m", where) for v in position_m]
    codes += [_code(v, ROTATION_STEP_RAD, "rad", where) for v in rotation_rad]
    return b"".join(code.to_bytes(2, "big", signed=True) for code in codes)


def unpack_pose(data: bytes, where: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Inverse of ``pack_pose``: within half a step of what was packed.

    Raises:
        BadMessage: not 12 bytes, or the one 16-bit code that is never packed.

    """
    if len(data) != 12:
        raise BadMessage(where, f"{len(data)} bytes of pose", "A pose has 12.")
    x, y, z, a, b, c = (int.from_bytes(data[i : i + 2], "big", signed=True) for i in range(0, 12, 2))
    if min(x, y, z, a, b, c) < -_CODE_MAX:
        raise BadMessage(where, f"pose {data.hex()} is out of range", f"Codes go from {-_CODE_MAX} to {_CODE_MAX}.")
    p, r = POSITION_STEP_M, ROTATION_STEP_RAD
    return (x * p, y * p, z * p), (a * r, b * r, c * r)


def _code(value: float, step: float, unit: str, where: str) -> int:
    if not math.isfinite(value) or abs(round(value / step)) > _CODE_MAX:
        raise BadMessage(where, f"{value!r} {unit} cannot be sent", f"At most ±{_CODE_MAX * step:.4g} {unit} fits.")
    return round(value / step)


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
    from PIL import Image

    if pixels.dtype != np.uint8 or not (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)):
        raise BadMessage("image", f"pixels {pixels.dtype} {pixels.shape}", "Give uint8 of (h, w) or (h, w, 3).")
    if pixels.size == 0 or not (0 < width < 65536 and 0 < height < 65536 and 1 <= quality <= 95):
        raise BadMessage("image", f"{width} x {height} px at quality {quality}", "Give 1 to 65535 px, quality 1 to 95.")
    # Luma of ITU-R BT.601, Pillow's "L"; its bilinear filter averages when shrinking.
    picture = Image.fromarray(pixels).convert("L").resize((width, height), Image.Resampling.BILINEAR)
    sink = io.BytesIO()
    picture.save(sink, "JPEG", quality=quality, optimize=True)
    return sink.getvalue()


def jpeg_size(jpeg: bytes, where: str) -> tuple[int, int]:
    """Width and height [px] of a whole grey JPEG.

    Raises:
        BadMessage: the bytes are cut off or are no grey JPEG.

    """
    if not (jpeg.startswith(_JPEG_START) and jpeg.endswith(_JPEG_END)):
        raise BadMessage(where, f"{len(jpeg)} bytes are no whole JPEG", "Give a whole grey JPEG.")
    with _opened(jpeg, where) as picture:
        if picture.mode != "L":
            raise BadMessage(where, f"a JPEG in mode {picture.mode}", "Give a whole grey JPEG.")
        return picture.size


def jpeg_pixels(jpeg: bytes, where: str) -> np.ndarray:
    """The pixels (h, w) uint8 of a grey JPEG.

    Raises:
        BadMessage: the bytes are damaged.

    """
    with _opened(jpeg, where) as picture:
        return np.asarray(picture)


@contextmanager
def _opened(jpeg: bytes, where: str) -> Iterator[PillowImage]:
    """A JPEG in Pillow, with all that Pillow says about damaged bytes turned into ``BadMessage``."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            # Damage can make a header promise gigapixels.
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(jpeg), formats=("JPEG",)) as picture:
                yield picture
    except BadMessage:
        raise
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombWarning, Image.DecompressionBombError) as error:
        raise BadMessage(where, f"{len(jpeg)} bytes are no sound JPEG: {error}", "Send it again.") from None
