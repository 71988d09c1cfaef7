"""How long work with a template takes, and movements by eye: figures of ``template_layer.toml``, sums of elements."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

from teleop_sim.operators.timing import OperatorTiming


@dataclass(frozen=True)
class LayerFigures:
    """The figures of ``template_layer.toml``; see there."""

    deliberation: float
    preview_views: int
    menu_words: int
    outcome_words: int
    motion_s: float
    tolerance_m: float
    longest_m: float
    error: float
    arc_rad: float
    go_rad: float
    go_ghosts: int
    before_m: float
    moves: int
    tries: int
    rounds: int
    finer: float
    finest_mm: int


WORDS_OF_WATCH = 2
"""That whoever watches says of a movement (assumed: such as "hand in")."""


@cache
def load_layer() -> LayerFigures:
    """The figures of ``template_layer.toml``."""
    text = resources.files("teleop_sim.operators").joinpath("template_layer.toml").read_text(encoding="utf-8")
    return LayerFigures(**{name: entry["value"] for name, entry in tomllib.loads(text).items()})


def layer_elements(timing: OperatorTiming, figures: LayerFigures, watched: bool = False) -> dict[str, float]:
    """Mean times of the pieces of a template command [s], deliberation in them.

    ``choose``: in the template's menu: prepare, open it, find and read the entry, take it. ``preview``: choose, then
    look at the ghost from several views, verify. ``order``: choose, prepare, point, click, verify. ``judge``: turn to
    the picture, search it, read what came of the step, verify; ``watched``: read it and hear two words from whoever
    has watched the robot instead.

    Source of the acts: Romay et al., section 6.2.1 and Figure 3b; of the times: the keystroke-level model, Cogulator.
    """
    click = timing.point_s + timing.click_s
    choose = timing.mental_s + click + timing.search_s + figures.menu_words * timing.read_per_word_s + click
    views = figures.preview_views * (click + timing.read_image_s())
    told_s = timing.read_line_s(figures.outcome_words)
    judge = timing.turn_s + timing.read_image_s() + told_s + timing.verify_s
    if watched:
        judge = told_s + timing.talk_s(WORDS_OF_WATCH)
    pieces = {
        "choose": choose,
        "preview": choose + views + timing.verify_s,
        "order": choose + timing.mental_s + click + timing.verify_s,
        "judge": judge,
    }
    return {name: figures.deliberation * seconds for name, seconds in pieces.items()}
