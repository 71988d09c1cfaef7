"""Light on a scene, for its cameras."""

from __future__ import annotations

from dataclasses import dataclass

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Light:
    """One sun and light from everywhere.

    Attributes:
        to_sun: unit vector.
        sun: red, green, blue of the sun on a surface that faces it; 1 shows a surface's own colour.
        ambient: brightness of a surface in the shadow, in 0..1.

    """

    to_sun: Triple
    sun: Triple
    ambient: float


NOON = Light((0.0, 0.0, 1.0), (0.9, 0.9, 0.9), 0.3)
"""A white sun overhead (assumed)."""
