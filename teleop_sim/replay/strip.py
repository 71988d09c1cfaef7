"""The words under a video's picture: a strip of three lines."""

from __future__ import annotations

from functools import cache

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from teleop_sim.replay.telling import Told

LINES = 3
SHARE = 0.032
"""Height of the letters as a share of the video's height, at least ``LEAST_PX`` (assumed: legible)."""
LEAST_PX = 11
PAPER, INK, FAINT = (24, 27, 31), (235, 238, 242), (150, 158, 168)
LINK_INK = {"idle": FAINT, "busy": (120, 200, 255), "dark": (255, 110, 90)}
MODE_INK = {"normal": INK, "auto": (255, 205, 90), "manual": (255, 165, 70), "not_recoverable": (255, 110, 90)}


def strip_height_px(height_px: int) -> int:
    """How much of a video's height the words take; even, as the video's is."""
    return 2 * round((LINES * 1.45 + 0.6) * _letters_px(height_px) / 2)


def strip(told: Told, clock: str, width_px: int, height_px: int) -> np.ndarray:
    """The words for one time: (strip height, width, 3) uint8.

    Args:
        told: what went on.
        clock: the time as it is shown.
        width_px, height_px: of the whole video.

    """
    letters = _letters_px(height_px)
    font = _font(letters)
    page = Image.new("RGB", (width_px, strip_height_px(height_px)), PAPER)
    draw = ImageDraw.Draw(page)
    rows = [round((0.45 + 1.45 * k) * letters) for k in range(LINES)]
    edge = round(0.8 * letters)
    right = _link(draw, told, width_px - edge, rows[0], font)
    mode = "" if told.mode == "normal" else f" ({told.mode.replace('_', ' ')})"
    state = f"{told.state.replace('/', ' / ')}{mode}"
    x = edge + draw.textlength(clock, font) + letters
    draw.text((edge, rows[0]), clock, INK, font)
    doing = told.ended or told.doing
    words = _fitting(draw, " · ".join(filter(None, (state, doing))), right - x - letters, font)
    draw.text((x, rows[0]), words, MODE_INK.get(told.mode, INK), font)
    for row, text, ink in ((rows[1], told.crew, INK), (rows[2], told.line and f"log: {told.line}", FAINT)):
        draw.text((edge, row), _fitting(draw, text, width_px - 2 * edge, font), ink, font)
    return np.asarray(page)


def _link(draw: ImageDraw.ImageDraw, told: Told, right: float, row: int, font: _Font) -> float:
    """Both directions, from the right; returns where they begin."""
    for way in reversed(told.link):
        text = f"{way} {told.link[way]}"
        right -= draw.textlength(text, font)
        draw.text((right, row), text, LINK_INK[told.link[way]], font)
        right -= draw.textlength("  ", font)
    return right


def _fitting(draw: ImageDraw.ImageDraw, text: str, width_px: float, font: _Font) -> str:
    """As much of a text as there is room for."""
    text = " ".join(text.split())
    if draw.textlength(text, font) <= width_px:
        return text
    low, high = 0, len(text)
    while low < high:
        middle = (low + high + 1) // 2
        if draw.textlength(f"{text[:middle]}...", font) <= width_px:
            low = middle
        else:
            high = middle - 1
    return f"{text[:low]}..."


def _letters_px(height_px: int) -> int:
    return max(LEAST_PX, round(SHARE * height_px))


_Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


@cache
def _font(letters_px: int) -> _Font:
    """Pillow's own letters: the same on every machine."""
    return ImageFont.load_default(letters_px)
