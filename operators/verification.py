"""What an eye makes of a picture that has arrived and of marks laid over it: is the thing where the robot says it is?

Two steps. An *ideal observer* finds, in the pixels that arrived, the place near a mark that looks most like what is
marked: normalised correlation with its plain appearance (a wheel is a disc darker than the console around it, a knob a
ball brighter than the wheel under it). Then a *person's* judgement by signal detection: evidence is d' plus a standard
normal, d' the offset over what an eye can tell; evidence above the person's criterion is a rejection. So the false-alarm
rate of a claim that is exactly right is Phi(-criterion), and a hit's Phi(d' - criterion).

Everything is made of bytes that have arrived, and of what a console looks like, which everybody knows beforehand.

Sources: D. M. Green, J. A. Swets, Signal Detection Theory and Psychophysics (1966); N. A. Macmillan, C. D. Creelman,
Detection Theory: A User's Guide (yes/no task, equal variances): d' = z(H) - z(F). J. P. Lewis, Fast Normalized
Cross-Correlation (1995). The bound on the ideal observer's place is Cramér's and Rao's for a known shape in white noise.

Not modelled: colour (pictures are grey), depth (an offset along the line of sight does not show), learning, haste.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from teleop_sim.channel.messages import PixelMark

Floats = npt.NDArray[np.float64]

CRITERION: Final = 3.5
"""Default of a person's criterion (assumed): two centimetres, what a grasp bears, are 4.5 px at the console, of which an
eye tells 1.2; a claim that is exactly right is refused in 0.02 %."""

EYE_PX: Final = 1.0
"""Standard deviation with which a middle is seen off a mark on the screen (assumed: a pixel)."""

WEBER: Final = 0.02
"""The same as a share of the thing's size: lengths and positions are told apart to 1 to 2 % (S. A. Hempenius,
Physiological and psychological aspects of photogrammetry, ISP Congress 1968, after Davson 1962)."""

RING: Final = {"wheel": 1.35, "handle": 1.8}
"""Outer radius of the surroundings that belong to a thing's look, in its own radii (assumed)."""

POLARITY: Final = {"wheel": -1.0, "handle": 1.0}
"""Darker or brighter than its surroundings: red and blue wheels on a grey console, grey knobs on them."""

REACH: Final = {"wheel": 1.0, "handle": 5.0}
"""How far around a mark an eye searches, in the thing's radii (assumed: a wheel's own width; across its wheel)."""

REACH_PX: Final = 48.0
"""Nor farther than this, a seventh of the picture's width (assumed)."""

LIKENESS: Final = 0.35
"""Least correlation of what counts as the thing at all (assumed; docs/operator.md has what it is where it is there)."""

SHOWN: Final = 0.6
"""Least share of a thing that must lie inside the picture to be judged (assumed)."""

LEAST_PX: Final = 1.5
"""Smaller things cannot be made out (assumed)."""


@dataclass(frozen=True)
class Found:
    """What the ideal observer makes of one mark.

    Attributes:
        what: its name.
        offset_px: from the mark; if nothing there looks like it, how far it was searched.
        sigma_px: what an eye can tell of it.
        likeness: correlation there, -1 to 1.

    """

    what: str
    offset_px: float
    sigma_px: float
    likeness: float

    @property
    def d_prime(self) -> float:
        """Offset in units of what can be told."""
        return self.offset_px / self.sigma_px


@dataclass(frozen=True)
class Judgement:
    """What a person decides: ``rejected`` where ``evidence`` exceeds ``criterion``; ``found`` is the worst mark."""

    found: Found
    evidence: float
    criterion: float

    @property
    def rejected(self) -> bool:
        """Is the claim refused?"""
        return self.evidence > self.criterion


def judge(
    grey: np.ndarray, marks: tuple[PixelMark, ...], criterion: float, rng: np.random.Generator
) -> Judgement | None:
    """Compare a claim with a picture. Draws once, whatever it finds.

    Args:
        grey: (h, w) uint8, as it arrived.
        marks: of the claim.
        criterion: of this person, in standard deviations; more rejects less.
        rng: the eye's noise.

    Returns:
        The judgement by the worst mark; None if the picture shows none of what is marked.

    """
    noise = float(rng.standard_normal())
    seen = tuple(found for found in (find(grey, mark) for mark in marks) if found is not None)
    if not seen:
        return None
    worst = max(seen, key=lambda found: found.d_prime)
    return Judgement(worst, worst.d_prime + noise, criterion)


def find(grey: np.ndarray, mark: PixelMark) -> Found | None:
    """Where near a mark the thing is; None if the picture cannot show it there."""
    kind = mark.what.rpartition("_")[2]
    if min(mark.half_width, mark.half_height) < LEAST_PX:
        return None
    searched = min(REACH[kind] * mark.half_width, REACH_PX)
    reach = math.ceil(searched)
    half = (math.ceil(RING[kind] * mark.half_width) + 1, math.ceil(RING[kind] * mark.half_height) + 1)
    column, row = math.floor(mark.across), math.floor(mark.down)
    shape, weight = _look(mark, kind, half, (mark.across - column - 0.5, mark.down - row - 0.5))
    pixels, inside = _cut(grey, column, row, (half[0] + reach, half[1] + reach))
    if weight.sum() * SHOWN > (weight * _middle(inside, reach)).sum():
        return None
    likeness = _correlation(pixels, inside, shape, weight)
    place = np.unravel_index(int(np.argmax(likeness)), likeness.shape)
    best, (down, across) = float(likeness[place]), _refined(likeness, place)
    offset = math.hypot(across - reach, down - reach)
    bound = _bound_px(pixels, inside, shape, weight, place)
    sigma = math.sqrt(EYE_PX**2 + (WEBER * 2.0 * mark.half_width) ** 2 + bound**2)
    if best < LIKENESS:
        offset, sigma = searched, math.hypot(EYE_PX, WEBER * 2.0 * mark.half_width)
    return Found(mark.what, offset, sigma, best)


def _look(mark: PixelMark, kind: str, half: tuple[int, int], shift: tuple[float, float]) -> tuple[Floats, Floats]:
    """The thing's plain appearance and its weight, (2 half + 1) pixels; edges are a pixel wide."""
    x = (np.arange(-half[0], half[0] + 1) - shift[0]) / mark.half_width
    y = (np.arange(-half[1], half[1] + 1) - shift[1]) / mark.half_height
    r = np.hypot(x[None, :], y[:, None])
    share = np.clip((1.0 - r) * mark.half_width + 0.5, 0.0, 1.0)
    return POLARITY[kind] * (2.0 * share - 1.0), (r <= RING[kind]).astype(float)


def _cut(grey: np.ndarray, column: int, row: int, half: tuple[int, int]) -> tuple[Floats, Floats]:
    """Pixels around a place, and 1 where the picture has any."""
    size = (2 * half[1] + 1, 2 * half[0] + 1)
    pixels, inside = np.zeros(size), np.zeros(size)
    top, left = row - half[1], column - half[0]
    rows = slice(max(top, 0), min(top + size[0], grey.shape[0]))
    columns = slice(max(left, 0), min(left + size[1], grey.shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        to = (slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left))
        pixels[to], inside[to] = grey[rows, columns] / 255.0, 1.0
    return pixels, inside


def _middle(inside: Floats, reach: int) -> Floats:
    return inside[reach : inside.shape[0] - reach, reach : inside.shape[1] - reach]


def _correlation(pixels: Floats, inside: Floats, shape: Floats, weight: Floats) -> Floats:
    """Weighted normalised correlation at every place of the search, (2 reach + 1, 2 reach + 1); -1 where too little shows."""
    size = (pixels.shape[0] + shape.shape[0] - 1, pixels.shape[1] + shape.shape[1] - 1)
    valid = tuple(slice(s - 1, p) for s, p in zip(shape.shape, pixels.shape, strict=True))

    def spectrum(a: Floats) -> npt.NDArray[np.complex128]:
        return np.fft.rfft2(a, size)

    def slide(a: npt.NDArray[np.complex128], kernel: npt.NDArray[np.complex128]) -> Floats:
        return np.fft.irfft2(a * kernel, size)[valid]

    one, value, square = spectrum(inside), spectrum(pixels), spectrum(pixels**2)
    k, kt, ktt = (spectrum(part[::-1, ::-1]) for part in (weight, weight * shape, weight * shape**2))
    n = np.maximum(slide(one, k), 1e-9)
    i, ii, t, tt, it = slide(value, k), slide(square, k), slide(one, kt), slide(one, ktt), slide(value, kt)
    spread = np.maximum(ii - i * i / n, 0.0) * np.maximum(tt - t * t / n, 0.0)
    shown = (n >= SHOWN * weight.sum()) & (spread > 1e-9)
    return np.where(shown, (it - i * t / n) / np.sqrt(np.where(shown, spread, 1.0)), -1.0)


def _refined(likeness: Floats, place: tuple[np.intp, ...]) -> tuple[float, float]:
    """The peak between pixels, by a parabola along each axis."""
    at = []
    for axis, k in enumerate(place):
        line = likeness[:, place[1]] if axis == 0 else likeness[place[0], :]
        bend = 0.0
        if 0 < k < len(line) - 1:
            a, b, c = float(line[k - 1]), float(line[k]), float(line[k + 1])
            curve = a - 2.0 * b + c
            bend = 0.5 * (a - c) / curve if curve < 0.0 else 0.0
        at.append(float(k) + min(max(bend, -0.5), 0.5))
    return at[0], at[1]


def _bound_px(pixels: Floats, inside: Floats, shape: Floats, weight: Floats, place: tuple[np.intp, ...]) -> float:
    """Least standard deviation [px] with which the thing's place can be told: noise over slope and contrast."""
    part = (slice(int(place[0]), int(place[0]) + shape.shape[0]), slice(int(place[1]), int(place[1]) + shape.shape[1]))
    w, cut = weight * inside[part], pixels[part]
    total = max(float(w.sum()), 1.0)
    t, i = shape - float((w * shape).sum()) / total, cut - float((w * cut).sum()) / total
    contrast = float((w * t * i).sum()) / max(float((w * t * t).sum()), 1e-12)
    noise = float((w * (i - contrast * t) ** 2).sum()) / total
    slopes = [float((w * g * g).sum()) for g in np.gradient(shape)]
    return math.sqrt(noise / max(contrast**2 * min(slopes), 1e-12))
