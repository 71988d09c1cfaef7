"""What an eye makes of a picture that has arrived and of marks laid over it: is the thing where the robot says it is?

Two steps. An *ideal observer* measures, in the pixels that arrived, how far a thing is from its mark. It takes the
place that looks most like it: normalised correlation with its plain appearance (a wheel is a disc darker than the
console around it, a knob a ball brighter than the wheel under it) and with its rim; of places that look nearly alike
the nearest. Two wheels must also stand on one plain body. Then a *person* judges, by signal detection: evidence is d'
plus a standard normal, d' the offset (or unevenness) over what an eye can tell; evidence above the person's criterion
is a rejection. So where nothing is off the false-alarm rate is Phi(-criterion), and the rate of hits Phi(d' -
criterion).

Everything is made of bytes that have arrived, and of what a console looks like, which everybody knows beforehand.

Sources: D. M. Green, J. A. Swets, Signal Detection Theory and Psychophysics (1966); N. A. Macmillan, C. D. Creelman,
Detection Theory: A User's Guide (yes/no task, equal variances): d' = z(H) - z(F). J. P. Lewis, Fast Normalized
Cross-Correlation (1995). The bound on the ideal observer's place is that of Cramér and Rao for a known shape in white
noise.

Not modelled: colour (pictures are grey), depth (an offset along the line of sight does not show), learning, haste.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from teleop_sim.channel.messages import PixelMark
from teleop_sim.operators.likeness import likenesses

Floats = npt.NDArray[np.float64]

CRITERION: Final = 6.0
"""Default of a person's criterion (assumed): so far off that a grasp, which bears 2 cm or 4.5 px at the console, would
surely miss; a claim that is right is refused in about one case of six (docs/operator.md)."""

EYE_PX: Final = 1.0
"""Standard deviation with which a middle is seen off a mark on the screen (assumed: a pixel)."""

WEBER: Final = 0.02
"""The same as a share of the thing's size: lengths and positions are told apart to 1 to 2 % (S. A. Hempenius,
Physiological and psychological aspects of photogrammetry, ISP Congress 1968, after Davson 1962)."""

RING: Final = {"wheel": 1.35, "handle": 1.8}
"""Outer radius of the surroundings that belong to a thing's look, in its own radii (assumed)."""

POLARITY: Final = {"wheel": -1.0, "handle": 1.0}
"""Darker or brighter than its surroundings: red and blue wheels on a grey console, grey knobs on them."""

REACH: Final = {"wheel": 2.0, "handle": 5.0}
"""How far around a mark an eye searches, in the thing's radii (assumed: twice a wheel; across its wheel)."""

REACH_PX: Final = 48.0
"""Nor farther than this, a seventh of the picture's width (assumed)."""

LIKENESS: Final = 0.28
"""Least correlation, mean of tone and rim, of what counts as the thing at all (assumed: 19 of 20 true ones have more,
docs/operator.md)."""

AS_GOOD: Final = 0.75
"""A peak of so much of the best one's correlation may be the thing (assumed, as the one that finds true ones best)."""

RIM_PX: Final = 1.2
"""Half width of an edge in a picture of that resolution and quality (assumed)."""

BODY: Final = (0.42, 1.22)
BODY_HALF: Final = 0.75
"""What is looked at below two wheels, in their distance: from under them down, and to either side. The console's front
is 1.9 distances wide and 2 high (its blocks, known beforehand)."""

BODY_LEAST_PX: Final = 3
"""Fewer rows or columns show no body (assumed)."""

TONE: Final = 0.03
"""Least difference of brightness that is told, as a share (assumed; Weber's fraction of brightness is 0.02 to 0.03)."""

SHOWN: Final = 0.6
"""Least share of a thing that must lie inside the picture to be judged (assumed)."""

LEAST_PX: Final = 1.5
"""Smaller things cannot be made out (assumed)."""


@dataclass(frozen=True)
class Found:
    """What the ideal observer makes of one thing.

    Attributes:
        what: its name; ``body``: what the wheels should stand on.
        offset_px: from the mark; if nothing there looks like it, how far it was searched. Of the body: NaN.
        sigma_px: what an eye can tell of it. Of the body: NaN.
        likeness: correlation there, -1 to 1. Of the body: one less how uneven it is.
        d_prime: how far it is from what is claimed, in units of what can be told.

    """

    what: str
    offset_px: float
    sigma_px: float
    likeness: float
    d_prime: float


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
        The judgement by the worst thing; None if the picture shows none of what is marked.

    """
    noise = float(rng.standard_normal())
    claimed = things(marks)
    looked = (*(find(grey, thing) for thing in claimed), *(body(grey, thing) for thing in claimed if len(thing) > 1))
    seen = tuple(found for found in looked if found is not None)
    if not seen:
        return None
    worst = max(seen, key=lambda found: found.d_prime)
    return Judgement(worst, worst.d_prime + noise, criterion)


def things(marks: tuple[PixelMark, ...]) -> tuple[tuple[PixelMark, ...], ...]:
    """What is looked for as one: two wheels belong together, each handle stands for itself."""
    wheels = tuple(mark for mark in marks if _kind(mark) == "wheel")
    return (*((wheels,) if wheels else ()), *((mark,) for mark in marks if _kind(mark) != "wheel"))


def find(grey: np.ndarray, thing: tuple[PixelMark, ...]) -> Found | None:
    """Where near its marks a thing is; None if the picture cannot show it there."""
    kind, width = _kind(thing[0]), max(mark.half_width for mark in thing)
    if min(min(mark.half_width, mark.half_height) for mark in thing) < LEAST_PX:
        return None
    searched = min(REACH[kind] * width, REACH_PX)
    reach = math.ceil(searched)
    column, row = (math.floor(sum(v) / len(thing)) for v in zip(*((m.across, m.down) for m in thing), strict=True))
    look, rim, weight = _looks(thing, kind, column, row)
    half = (look.shape[1] // 2, look.shape[0] // 2)
    pixels, inside = _cut(grey, column, row, (half[0] + reach, half[1] + reach))
    if weight.sum() * SHOWN > (weight * _middle(inside, reach)).sum():
        return None
    likeness = likenesses(pixels, inside, look, rim, weight, SHOWN)
    place = _nearest_peak(likeness, reach)
    best, (down, across) = float(likeness[place]), _refined(likeness, place)
    sigma = math.hypot(EYE_PX, WEBER * 2.0 * width)
    what = thing[0].what if len(thing) == 1 else kind + "s"
    if best < LIKENESS:
        return Found(what, searched, sigma, best, searched / sigma)
    bound = _bound_px(pixels, inside, look, weight, place)
    offset, sigma = math.hypot(across - reach, down - reach), math.hypot(sigma, bound)
    return Found(what, offset, sigma, best, offset / sigma)


def body(grey: np.ndarray, wheels: tuple[PixelMark, ...]) -> Found | None:
    """Whether two wheels stand on one plain body: how much the brightness varies from left to right below them.

    Two things that stand apart have the ground between them. None if the picture ends above it.
    """
    left, right = min(m.across for m in wheels), max(m.across for m in wheels)
    middle, apart, down = 0.5 * (left + right), right - left, sum(m.down for m in wheels) / len(wheels)
    rows = [int(min(max(down + k * apart, 0.0), float(grey.shape[0]))) for k in BODY]
    columns = [int(min(max(middle + k * apart, 0.0), float(grey.shape[1]))) for k in (-BODY_HALF, BODY_HALF)]
    if rows[1] - rows[0] < BODY_LEAST_PX or columns[1] - columns[0] < BODY_LEAST_PX:
        return None
    profile = _part(grey, slice(*rows), slice(*columns)).mean(axis=0)
    # An eye is adapted to the picture as a whole: in the dark it tells less.
    uneven = float(profile.std()) / max(float(grey.mean()) / 255.0, 1e-3)
    return Found("body", math.nan, math.nan, 1.0 - uneven, uneven / TONE)


def _kind(mark: PixelMark) -> str:
    return mark.what.rpartition("_")[2]


def _looks(thing: tuple[PixelMark, ...], kind: str, column: int, row: int) -> tuple[Floats, Floats, Floats]:
    """A thing's plain appearance, its rim, and its weight around a pixel; edges are a pixel wide."""
    ring = RING[kind]
    half_w = max(math.ceil(abs(m.across - column) + ring * m.half_width) for m in thing) + 1
    half_h = max(math.ceil(abs(m.down - row) + ring * m.half_height) for m in thing) + 1
    x, y = np.arange(-half_w, half_w + 1) + column + 0.5, np.arange(-half_h, half_h + 1) + row + 0.5
    size = (len(y), len(x))
    look, rim, weight = np.full(size, -1.0), np.zeros(size), np.zeros(size)
    for mark in thing:
        r = np.hypot(((x - mark.across) / mark.half_width)[None, :], ((y - mark.down) / mark.half_height)[:, None])
        look = np.maximum(look, 2.0 * np.clip((1.0 - r) * mark.half_width + 0.5, 0.0, 1.0) - 1.0)
        rim = np.maximum(rim, np.exp(-0.5 * ((r - 1.0) * mark.half_width / RIM_PX) ** 2))
        weight = np.maximum(weight, (r <= ring).astype(float))
    return POLARITY[kind] * look, rim, weight


def _blurred(grey: Floats) -> Floats:
    """The picture as an eye takes it in that does not look at single pixels: binomial, [1, 2, 1] / 4 each way."""
    padded = np.pad(grey, 1, mode="edge")
    rows = 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
    return np.asarray(0.25 * rows[:, :-2] + 0.5 * rows[:, 1:-1] + 0.25 * rows[:, 2:])


def _part(grey: np.ndarray, rows: slice, columns: slice) -> Floats:
    """A part of the blurred picture."""
    top, left = max(rows.start - 1, 0), max(columns.start - 1, 0)
    around = _blurred(grey[top : rows.stop + 1, left : columns.stop + 1] / 255.0)
    return around[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]


def _nearest_peak(likeness: Floats, reach: int) -> tuple[int, int]:
    """Of the peaks that are nearly as good as the best the one nearest to the mark: an eye begins there."""
    best = float(likeness.max())
    around = np.pad(likeness, 1, constant_values=-2.0)
    size = likeness.shape
    beside = np.max([around[i : i + size[0], j : j + size[1]] for i in range(3) for j in range(3)], axis=0)
    rows, columns = np.nonzero((likeness >= beside) & (likeness >= AS_GOOD * best))
    if not len(rows):
        return (reach, reach)
    k = int(np.argmin(np.hypot(rows - reach, columns - reach)))
    return int(rows[k]), int(columns[k])


def _cut(grey: np.ndarray, column: int, row: int, half: tuple[int, int]) -> tuple[Floats, Floats]:
    """Pixels around a place, blurred, and 1 where the picture has any."""
    size = (2 * half[1] + 1, 2 * half[0] + 1)
    pixels, inside = np.zeros(size), np.zeros(size)
    top, left = row - half[1], column - half[0]
    rows = slice(max(top, 0), min(top + size[0], grey.shape[0]))
    columns = slice(max(left, 0), min(left + size[1], grey.shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        to = (slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left))
        pixels[to], inside[to] = _part(grey, rows, columns) / 255.0, 1.0
    return pixels, inside


def _middle(inside: Floats, reach: int) -> Floats:
    return inside[reach : inside.shape[0] - reach, reach : inside.shape[1] - reach]


def _refined(likeness: Floats, place: tuple[int, int]) -> tuple[float, float]:
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


def _bound_px(pixels: Floats, inside: Floats, shape: Floats, weight: Floats, place: tuple[int, int]) -> float:
    """Least standard deviation [px] with which the thing's place can be told: noise over slope and contrast."""
    part = (slice(int(place[0]), int(place[0]) + shape.shape[0]), slice(int(place[1]), int(place[1]) + shape.shape[1]))
    w, cut = weight * inside[part], pixels[part]
    total = max(float(w.sum()), 1.0)
    t, i = shape - float((w * shape).sum()) / total, cut - float((w * cut).sum()) / total
    contrast = float((w * t * i).sum()) / max(float((w * t * t).sum()), 1e-12)
    noise = float((w * (i - contrast * t) ** 2).sum()) / total
    slopes = [float((w * g * g).sum()) for g in np.gradient(shape)]
    return math.sqrt(noise / max(contrast**2 * min(slopes), 1e-12))
