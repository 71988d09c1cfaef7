"""Numbers on a grid: resolution, limits, refusal, and an independent reading of the bits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.quantise import GROUND, JOINT, POSITION, ROTATION, Grid, pack_pose, unpack_joints, unpack_pose

GRIDS = [POSITION, ROTATION, GROUND, JOINT, Grid(0.25, 5, "s"), Grid(1e-3, 32, "m"), Grid(1.0, 2, "")]
grids = st.sampled_from(GRIDS)


@given(grids, st.lists(st.floats(-1.0, 1.0), max_size=12))
def test_numbers_come_back_within_half_a_step(grid, shares):
    values = [share * grid.reach for share in shares]
    packed = grid.pack(values, "here")
    assert len(packed) == math.ceil(grid.bits * len(values) / 8)
    # Half a step, and the rounding of a division and a multiplication.
    bound = grid.step / 2 + 4e-16 * grid.reach
    assert grid.unpack(packed, len(values), "here") == pytest.approx(values, rel=0, abs=bound)


@given(grids, st.data())
def test_what_is_on_the_grid_comes_back_exactly(grid, data):
    codes = data.draw(st.lists(st.integers(-grid.code_max, grid.code_max), max_size=12))
    values = tuple(code * grid.step for code in codes)
    packed = grid.pack(values, "here")
    assert grid.unpack(packed, len(codes), "here") == values
    bits = "".join(format(code % (1 << grid.bits), f"0{grid.bits}b") for code in codes)
    assert packed == bytes(int(bits[i : i + 8].ljust(8, "0"), 2) for i in range(0, len(bits), 8))


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("sign", [-1, 1])
def test_the_limits_are_sent_and_a_step_beyond_is_refused(grid, sign):
    assert grid.unpack(grid.pack([sign * grid.reach], "here"), 1, "here") == (sign * grid.reach,)
    # Half a step beyond still comes back within half a step.
    (back,) = grid.unpack(grid.pack([sign * (grid.reach + 0.49 * grid.step)], "here"), 1, "here")
    assert back == sign * grid.reach
    for beyond in (grid.reach + 0.51 * grid.step, grid.reach + grid.step, 1e308, math.inf, math.nan):
        with pytest.raises(BadMessage) as refused:
            grid.pack([sign * beyond], "here")
        where, what, hint = refused.value.args
        assert where == "here"
        assert grid.unit in what
        assert f"±{grid.reach:.4g}" in hint


@given(grids, st.integers(0, 6), st.binary(max_size=24))
def test_any_bytes_are_the_numbers_that_give_them_or_bad(grid, count, noise):
    try:
        values = grid.unpack(noise, count, "here")
    except BadMessage:
        return
    assert grid.pack(values, "here") == noise


def test_the_code_that_is_never_sent_and_bits_after_the_last_number_are_bad():
    with pytest.raises(BadMessage, match="out of range"):
        JOINT.unpack(bytes.fromhex("800001"), 2, "here")
    with pytest.raises(BadMessage, match="bits set after"):
        JOINT.unpack(bytes.fromhex("0011"), 1, "here")
    with pytest.raises(BadMessage, match="1 bytes for 1 numbers"):
        JOINT.unpack(b"\x00", 1, "here")
    with pytest.raises(BadMessage, match="no count"):
        unpack_joints(b"", "here")


def test_stated_resolutions():
    assert (POSITION.step, POSITION.reach) == (0.001, pytest.approx(32.767))
    assert (ROTATION.step, ROTATION.reach) == (pytest.approx(95.9e-6, rel=1e-3), pytest.approx(math.pi))
    assert (GROUND.step, GROUND.reach) == (0.005, pytest.approx(163.835))
    assert (JOINT.step, JOINT.reach) == (pytest.approx(1.535e-3, rel=1e-3), pytest.approx(math.pi))


def test_a_pose_keeps_the_bytes_it_had():
    # Big-endian two's complement, by hand: 1 m is 1000 = 0x03e8, -1 mm 0xffff, pi 0x7fff.
    packed = pack_pose((1.0, -0.001, 0.0), (math.pi, -math.pi, 0.0), "here")
    assert packed.hex() == "03e8ffff00007fff80010000"
    assert unpack_pose(packed, "here") == ((1.0, -0.001, 0.0), (pytest.approx(math.pi), pytest.approx(-math.pi), 0.0))
    with pytest.raises(BadMessage, match="11 bytes of pose"):
        unpack_pose(packed[:-1], "here")
