"""What people make of clouds and pictures that have arrived, remembered bit for bit.

To lay a template and to judge a claim are functions of bytes that arrived, of the person's figures and of where the
random stream stands. Under common random numbers many cells of a sweep ask for the same. ``FreshEyes`` work it out;
``EyeMemo`` asks its memory first. Nothing else tells them apart: results have the same bytes with either, and the
stream stands afterwards where it would have stood.

Not for several threads, and not shared between processes.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from teleop_sim.channel.messages import Image, PixelMark, VoxelCloud
from teleop_sim.core.fingerprint import fingerprint
from teleop_sim.operators.alignment import Aligned, AlignmentFigures, align, load_alignment
from teleop_sim.operators.verification import Judgement, judge
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, Triple

ENTRIES: Final = 4096
"""Results have a kilobyte or two each; a run makes a few dozen."""


class FreshEyes:
    """Works everything out anew, each time."""

    def align(
        self,
        template: Template,
        cloud: VoxelCloud,
        eye_m: Triple,
        rng: np.random.Generator,
        figures: AlignmentFigures | None = None,
        near: Pose | None = None,
    ) -> Aligned | None:
        """See ``alignment.align``."""
        return align(template, cloud, eye_m, rng, figures, near)

    def judge(
        self, image: Image, marks: tuple[PixelMark, ...], criterion: float, rng: np.random.Generator
    ) -> Judgement | None:
        """See ``verification.judge``; of the picture as it arrived.

        Raises:
            BadMessage: a damaged picture.

        """
        return judge(image.pixels(), marks, criterion, rng)


class EyeMemo(FreshEyes):
    """Remembers what it has worked out, least recently used first out.

    Args:
        entries: so many results are kept.

    Attributes:
        found, made: how many results were remembered, and worked out.

    """

    def __init__(self, entries: int = ENTRIES) -> None:
        self._entries = entries
        self._kept: OrderedDict[bytes, tuple[Any, Any]] = OrderedDict()
        self.found = self.made = 0

    def align(
        self,
        template: Template,
        cloud: VoxelCloud,
        eye_m: Triple,
        rng: np.random.Generator,
        figures: AlignmentFigures | None = None,
        near: Pose | None = None,
    ) -> Aligned | None:
        """See ``FreshEyes.align``. Of a template only its solids matter, of a cloud what is in its message."""
        figures = load_alignment() if figures is None else figures
        question = fingerprint("align", template.shapes, cloud, eye_m, _where(rng), figures, near)
        work = super().align
        aligned: Aligned | None = self._ask(question, rng, lambda: work(template, cloud, eye_m, rng, figures, near))
        return aligned

    def judge(
        self, image: Image, marks: tuple[PixelMark, ...], criterion: float, rng: np.random.Generator
    ) -> Judgement | None:
        """See ``FreshEyes.judge``. What is seen does not depend on the criterion: who asks again brings his own."""
        question = fingerprint("judge", image, marks, _where(rng))
        work = super().judge
        judgement: Judgement | None = self._ask(question, rng, lambda: work(image, marks, criterion, rng))
        return None if judgement is None else replace(judgement, criterion=criterion)

    def _ask(self, question: bytes, rng: np.random.Generator, work: Callable[[], Any]) -> Any:
        entry = self._kept.get(question)
        if entry is None:
            self.made += 1
            entry = self._kept[question] = work(), rng.bit_generator.state
            if len(self._kept) > self._entries:
                self._kept.popitem(last=False)
            return entry[0]
        self.found += 1
        self._kept.move_to_end(question)
        rng.bit_generator.state = entry[1]
        return entry[0]


def _where(rng: np.random.Generator) -> object:
    """Where a random stream stands."""
    return rng.bit_generator.state
