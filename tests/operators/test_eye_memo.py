"""What is remembered is what would have been worked out, bit for bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from teleop_sim.channel.messages import PixelMark, encode_image, encode_voxels
from teleop_sim.channel.pictures import sample_picture
from teleop_sim.operators.alignment import load_alignment
from teleop_sim.operators.memo import EyeMemo, FreshEyes
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose

VALVE = library().named("DRC_valve")
EYE_M = (0.0, 0.0, 1.7)
MARKS = (PixelMark("yaw_handle", 140.0, 80.0, 8.0, 8.0), PixelMark("pitch_handle", 200.0, 85.0, 8.0, 8.0))


def cloud(shift_m=0.0):
    """A wheel's rim 1.5 m ahead, drawn by formula."""
    turn, tube = np.linspace(0.0, 2.0 * np.pi, 400), np.tile(np.linspace(0.0, 6.0, 8), 50)
    wide = 0.2 + 0.013 * np.cos(tube)
    x = 1.5 + 0.013 * np.sin(tube)
    return encode_voxels(np.stack([x, shift_m + wide * np.cos(turn), 1.1 + wide * np.sin(turn)], axis=1), 0.01)


def image(quality=50):
    return encode_image(sample_picture(320, 170), 320, 170, quality)


def rng(key=1):
    return np.random.default_rng(key)


def laid(eyes, asked=None, key=1, **changes):
    """A result, and where the stream stands afterwards."""
    draws = rng(key)
    return repr(eyes.align(VALVE, asked or cloud(), EYE_M, draws, **changes)), draws.random()


def judged(eyes, picture=None, marks=MARKS, criterion=6.0, key=1):
    draws = rng(key)
    return repr(eyes.judge(picture or image(), marks, criterion, draws)), draws.random()


def test_what_is_remembered_is_what_is_worked_out_and_the_stream_goes_on():
    memo = EyeMemo()
    for ask in (laid, judged):
        fresh = ask(FreshEyes())
        assert [ask(memo), ask(memo)] == [fresh, fresh]
    assert (memo.found, memo.made) == (2, 2)


@pytest.mark.parametrize(
    "changes",
    [
        {"asked": cloud(0.1)},
        {"key": 2},
        {"near": Pose((1.5, 0.1, 1.1))},
        {"figures": replace(load_alignment(), residual_m=0.02)},
    ],
)
def test_another_cloud_stream_start_or_person_is_another_question(changes):
    memo = EyeMemo()
    laid(memo)
    assert laid(memo, **changes) == laid(FreshEyes(), **changes)
    assert (memo.found, memo.made) == (0, 2)


@pytest.mark.parametrize("changes", [{"picture": image(80)}, {"marks": MARKS[:1]}, {"key": 2}])
def test_another_picture_claim_or_stream_is_another_question(changes):
    memo = EyeMemo()
    judged(memo)
    assert judged(memo, **changes) == judged(FreshEyes(), **changes)
    assert (memo.found, memo.made) == (0, 2)


def test_another_criterion_is_the_same_look():
    memo = EyeMemo()
    judged(memo)
    assert judged(memo, criterion=1.0) == judged(FreshEyes(), criterion=1.0)
    assert (memo.found, memo.made) == (1, 1)


def test_the_oldest_is_forgotten():
    memo = EyeMemo(entries=2)
    for key in (1, 2, 3, 1):
        judged(memo, key=key)
    assert (memo.found, memo.made) == (0, 4)
