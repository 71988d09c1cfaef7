"""Red and blue blobs of an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from teleop_sim.robot.perception.camera import Image
from teleop_sim.robot.perception.components import Index, blobs
from teleop_sim.robot.perception.rays import Bools, Floats


@dataclass(frozen=True)
class Band:
    """A colour: range of hue [degrees, from ``hue_from`` upwards through 360], least saturation and value in 0..1."""

    hue_from: float
    hue_width: float
    saturation_min: float
    value_min: float


# Assumed: wide enough for a warm sun and shadows, narrow enough to leave brown soil out.
RED: Final = Band(344.0, 28.0, 0.59, 0.06)
BLUE: Final = Band(216.0, 48.0, 0.43, 0.06)

LEAST_SHARE: Final = 1.2e-4  # assumed: of the image, 6 pixels of 320 x 170
MOST_BLOBS: Final = 6  # assumed


@dataclass(frozen=True, eq=False)
class Blob:
    """Connected pixels of one colour: flat indices, and the middle across and down [pixels]."""

    pixels: Index
    across: float
    down: float

    @property
    def area(self) -> int:
        """Number of pixels."""
        return len(self.pixels)


def hue_saturation_value(rgb: Floats) -> tuple[Floats, Floats, Floats]:
    """Hue [degrees, 0 to 360], saturation and value [0..1] of colours (n, 3) in 0..1; hue 0 where there is none.

    Source: A. R. Smith, Color gamut transform pairs, SIGGRAPH 1978, 12-19.
    """
    r, g, b = rgb[:, 0], rgb[:, 1], rgb[:, 2]
    value = rgb.max(axis=1)
    chroma = value - rgb.min(axis=1)
    safe = np.where(chroma > 0.0, chroma, 1.0)
    sector = np.where(
        value == r, (g - b) / safe % 6.0, np.where(value == g, (b - r) / safe + 2.0, (r - g) / safe + 4.0)
    )
    hue = np.where(chroma > 0.0, 60.0 * sector, 0.0)
    return hue, chroma / np.where(value > 0.0, value, 1.0), value


def mask_of(image: Image, band: Band) -> Bools:
    """Pixels (height, width) whose colour lies in the band, without single specks and with small holes closed."""
    h, w = image.shape[:2]
    flat = image.reshape(-1, 3)
    # Most pixels are grey or brown: integers tell that quickly.
    red, green, blue = flat.T
    high = np.maximum(np.maximum(red, green), blue)
    chroma = high - np.minimum(np.minimum(red, green), blue)
    maybe = np.flatnonzero((chroma >= np.float32(band.saturation_min) * high) & (high >= 255.0 * band.value_min))
    hue, _, _ = hue_saturation_value(flat[maybe].astype(np.float64) / 255.0)
    mask = np.zeros(h * w, np.bool_)
    mask[maybe[(hue - band.hue_from) % 360.0 <= band.hue_width]] = True
    opened = _grown(_shrunk(mask.reshape(h, w)))
    return _shrunk(_grown(opened))


def blobs_of(image: Image, band: Band) -> list[Blob]:
    """The largest blobs of a colour, largest first; at most six, none below 0.012 % of the image."""
    h, w = image.shape[:2]
    found = [p for p in blobs(mask_of(image, band)) if len(p) >= LEAST_SHARE * w * h]
    return [Blob(p, float((p % w).mean()), float((p // w).mean())) for p in found[:MOST_BLOBS]]


def _grown(mask: Bools) -> Bools:
    wide = mask.copy()
    wide[:, 1:] |= mask[:, :-1]
    wide[:, :-1] |= mask[:, 1:]
    out = wide.copy()
    out[1:] |= wide[:-1]
    out[:-1] |= wide[1:]
    return out


def _shrunk(mask: Bools) -> Bools:
    return ~_grown(~mask)
