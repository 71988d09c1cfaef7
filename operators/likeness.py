"""How much every place of a picture looks like a thing: normalised correlation of tone and of edges, by transforms.

Source: J. P. Lewis, Fast Normalized Cross-Correlation (1995).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Number = Any
"""A number, or an array of one for each place searched."""


def likenesses(pixels: Floats, inside: Floats, look: Floats, rim: Floats, weight: Floats, least_shown: float) -> Floats:
    """Weighted normalised correlation, mean of tone's and rim's, at every place searched; -1: too little shows.

    Args:
        pixels, inside: (h, w), and 1 where the picture has any, else 0.
        look, rim, weight: (y, x), what is looked for: its tone, its edges, and what of it counts.
        least_shown: share of the weight that must lie inside.

    Returns:
        (h - y + 1, w - x + 1).

    """
    # Transforms go round in circles: what comes round falls on places that are not searched.
    size = (_smooth(pixels.shape[0]), _smooth(pixels.shape[1]))
    valid = tuple(slice(s - 1, p) for s, p in zip(look.shape, pixels.shape, strict=True))

    def spectra(*parts: Floats) -> npt.NDArray[np.complex128]:
        return np.fft.rfft2(np.stack(parts), size)

    def slid(*products: npt.NDArray[np.complex128]) -> Floats:
        return np.fft.irfft2(np.stack(products), size)[:, valid[0], valid[1]]

    whole, slopes, turned = bool(inside.all()), _slopes(pixels), weight[::-1, ::-1]
    shapes = look[::-1, ::-1], rim[::-1, ::-1]
    value, square, slope, steep = spectra(pixels, pixels**2, slopes, slopes**2)
    k, kl, kr = spectra(turned, turned * shapes[0], turned * shapes[1])
    sums = slid(value * k, square * k, value * kl, slope * k, steep * k, slope * kr)
    if whole:
        n, seen = weight.sum(), [((weight * s).sum(), (weight * s**2).sum()) for s in (look, rim)]
    else:
        (one,), (kll, krr) = spectra(inside), spectra(turned * shapes[0] ** 2, turned * shapes[1] ** 2)
        shown, *moments = slid(one * k, one * kl, one * kll, one * kr, one * krr)
        n, seen = np.maximum(shown, 1e-9), [(moments[0], moments[1]), (moments[2], moments[3])]
    enough = n >= least_shown * weight.sum()
    tone, edge = (_correlated(n, enough, sums[i : i + 3], *seen[i // 3]) for i in (0, 3))
    return np.where(np.minimum(tone, edge) > -1.0, (tone + edge) / 2.0, -1.0)


def _correlated(n: Number, enough: Number, sums: Floats, t: Number, tt: Number) -> Floats:
    """Normalised correlation from the sums of weights, of pixels, their squares and products, of shape and squares."""
    i, ii, it = sums
    spread = np.maximum(ii - i * i / n, 0.0) * np.maximum(tt - t * t / n, 0.0)
    shown = enough & (spread > 1e-9)
    return np.where(shown, (it - i * t / n) / np.sqrt(np.where(shown, spread, 1.0)), -1.0)


def _smooth(least: int) -> int:
    """The first length from ``least`` on without a prime factor above 7: transforms of others take long."""
    length = least
    while True:
        rest = length
        for factor in (2, 3, 5, 7):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return length
        length += 1


def _slopes(pixels: Floats) -> Floats:
    down, across = np.gradient(pixels)
    return np.asarray(np.hypot(down, across))
