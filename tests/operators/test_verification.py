"""An eye on a picture: laws of d', on pictures drawn here, whose truth is known."""

import math

import numpy as np
import pytest

from teleop_sim.channel.messages import PixelMark, encode_image
from teleop_sim.operators.verification import CRITERION, EYE_PX, body, find, judge, things

WHEELS = (("yaw_wheel", 120.0, 80.0), ("pitch_wheel", 190.0, 82.0))
KNOBS = (("yaw_handle", 110.0, 95.0), ("pitch_handle", 200.0, 93.0))
WHEEL_PX, KNOB_PX = 26.0, 6.0


def picture(noise: float = 3.0, contrast: float = 1.0, seed: int = 3, console: bool = True) -> np.ndarray:
    """A grey console with two dark wheels and two bright knobs on noisy ground, as it arrives: a JPEG of quality 50."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:170, 0:320] + 0.5
    scene = np.full((170, 320), 70.0)
    if console:
        scene[40:165, 80:230] = 110.0
        for _, u, v in WHEELS:
            scene[np.hypot(x - u, y - v) <= WHEEL_PX] = 45.0
        for _, u, v in KNOBS:
            scene[np.hypot(x - u, y - v) <= KNOB_PX] = 150.0
    grey = 70.0 + contrast * (scene - 70.0) + noise * rng.standard_normal(scene.shape)
    return encode_image(np.clip(grey, 0, 255).astype(np.uint8), 320, 170, 50).pixels()


def knob(off: float = 0.0, name: str = "yaw_handle") -> PixelMark:
    """A mark so many pixels beside the knob's true place."""
    u, v = next((u, v) for what, u, v in KNOBS if what == name)
    return PixelMark(name, u + off, v, KNOB_PX, KNOB_PX)


def wheels(off: float = 0.0) -> tuple[PixelMark, ...]:
    return tuple(PixelMark(what, u + off, v, WHEEL_PX, WHEEL_PX) for what, u, v in WHEELS)


@pytest.mark.parametrize("off", [0.0, 1.0, 2.5, 5.0, 9.0, 14.0])
def test_a_knob_is_found_where_it_is(off):
    found = find(picture(), (knob(off),))
    # A pixel's raster and JPEG blocks of 8 px leave a third of a pixel.
    assert found.offset_px == pytest.approx(off, abs=0.4)
    assert found.sigma_px >= EYE_PX


@pytest.mark.parametrize("off", [0.0, 4.0, 10.0])
def test_a_pair_of_wheels_is_found_where_it_is(off):
    (thing,) = things(wheels(off))
    # Knobs stand on the wheels' rims and pull by a part of a pixel.
    assert find(picture(), thing).offset_px == pytest.approx(off, abs=0.8)


def test_d_prime_grows_with_the_offset():
    seen = [find(picture(), (knob(off),)).d_prime for off in (0.0, 2.0, 4.0, 8.0, 12.0)]
    assert seen == sorted(seen)


def test_what_is_seen_less_well_has_a_lower_d_prime():
    clear, dim = (find(picture(noise=6.0, contrast=c), (knob(6.0),)) for c in (1.0, 0.5))
    assert dim.sigma_px > clear.sigma_px
    assert dim.d_prime < clear.d_prime


def test_half_the_resolution_halves_the_offset_in_pixels_and_lowers_d_prime():
    full = picture()
    half = encode_image(full, 160, 85, 50).pixels()
    mark = knob(8.0)
    small = PixelMark(mark.what, mark.across / 2, mark.down / 2, mark.half_width / 2, mark.half_height / 2)
    assert find(half, (small,)).offset_px == pytest.approx(4.0, abs=0.6)
    assert find(half, (small,)).d_prime < find(full, (mark,)).d_prime


def test_where_nothing_is_off_false_alarms_are_those_of_the_criterion():
    """P(reject) = Phi(d' - criterion) exactly: binomial, 4 sigma of 4,000 draws."""
    grey, mark, rng = picture(), (knob(),), np.random.default_rng(11)
    d_prime = find(grey, mark).d_prime
    for criterion in (0.5, 1.5):
        expected = 0.5 * math.erfc((criterion - d_prime) / math.sqrt(2.0))
        n = 400
        told = sum(judge(grey, mark, criterion, rng).rejected for _ in range(n))
        assert abs(told / n - expected) < 4 * math.sqrt(expected * (1 - expected) / n)


def test_the_evidence_is_d_prime_and_one_standard_normal():
    judgement = judge(picture(), (knob(3.0),), 2.0, np.random.default_rng(5))
    assert judgement.evidence == judgement.found.d_prime + np.random.default_rng(5).standard_normal()
    assert judgement.rejected == (judgement.evidence > 2.0)


def test_the_worst_of_what_is_claimed_decides():
    right, wrong = knob(), knob(12.0, "pitch_handle")
    judgement = judge(picture(), (right, wrong), CRITERION, np.random.default_rng(1))
    assert judgement.found.what == "pitch_handle"
    assert judgement.rejected


def test_where_there_is_no_console_a_claim_of_one_is_refused():
    judgement = judge(picture(console=False), (knob(), knob(0.0, "pitch_handle")), CRITERION, np.random.default_rng(2))
    assert judgement.rejected


def test_two_wheels_on_one_body_are_told_from_two_drums_with_ground_between():
    drums = np.full((170, 320), 90, np.uint8)
    for _, u, v in WHEELS:
        drums[int(v) - 26 : 165, int(u) - 26 : int(u) + 26] = 45
    drums = encode_image(drums, 320, 170, 50).pixels()
    assert body(drums, wheels()).d_prime > CRITERION > body(picture(), wheels()).d_prime + 2.0


@pytest.mark.parametrize("mark", [PixelMark("yaw_handle", -30.0, 50.0, 6.0, 6.0), PixelMark("yaw_handle", 9, 9, 1, 1)])
def test_what_the_picture_cannot_show_is_not_judged(mark):
    assert find(picture(), (mark,)) is None
    assert judge(picture(), (mark,), 1.0, np.random.default_rng(1)) is None


def test_a_judgement_is_a_function_of_the_bytes():
    one, other = (judge(picture(), wheels(2.0), 4.0, np.random.default_rng(9)) for _ in range(2))
    assert one == other
