"""The five walkways against the poses published in osrf/srcsim 0.8.0, worlds/final_1..5.world."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.world import dish_layout as lay

# x, y [m] and yaw [rad] as published. A published dish or box faces along its y axis, so headings differ by 90 degrees.
PUBLISHED = {
    1: ((2.376, 2.762, 0.000), (2.376, 0.362, 1.571), (5.070, -2.695), (6.501, -1.264)),
    2: ((2.376, -2.762, 3.142), (2.376, -0.362, -1.571), (6.186, 0.000), (6.186, -2.024)),
    3: ((4.385, 2.024, -0.785), (2.688, 0.327, 0.785), (5.740, -1.078), (5.740, -3.102)),
    4: ((2.376, 2.762, 0.000), (2.376, 0.362, 1.571), (5.516, 1.617), (6.947, 0.186)),
    5: ((4.385, 2.024, -0.785), (2.688, 0.327, 0.785), (5.070, -2.695), (6.501, -4.126)),
}
# The published figures are rounded to millimetres.
ROUNDING = 6e-4


def on_walkway(layout: lay.Layout, x: float, y: float) -> bool:
    for slab in layout.slabs:
        u, v, _ = lay.compose(lay.inverse(slab.pose), (x, y, 0.0))
        if abs(u) <= slab.half_along_m + 1e-9 and abs(v) <= slab.half_across_m + 1e-9:
            return True
    return False


@pytest.mark.parametrize("number", lay.LAYOUT_IDS)
def test_tiles_lead_to_the_published_places(number):
    layout = lay.layout(number)
    dish, checkpoint, finish, strip = PUBLISHED[number]
    assert layout.dish[:2] == pytest.approx(dish[:2], abs=ROUNDING)
    assert math.remainder(layout.dish[2] - dish[2] - math.pi / 2, math.tau) == pytest.approx(0.0, abs=ROUNDING)
    assert lay.checkpoint_1(layout.dish)[:2] == pytest.approx(checkpoint[:2], abs=ROUNDING)
    assert math.remainder(lay.checkpoint_1(layout.dish)[2] - checkpoint[2], math.tau) == pytest.approx(0, abs=ROUNDING)
    assert layout.finish[:2] == pytest.approx(finish, abs=ROUNDING)
    # Task 2's start strip lies 0.5 m along the tile behind the finish.
    tail = lay.compose(layout.slabs[-1].pose, (0.5 - 0.5 * lay.TILE_M, 0.0, 0.0))
    assert tail[:2] == pytest.approx(strip, abs=ROUNDING)


@pytest.mark.parametrize("number", lay.LAYOUT_IDS)
def test_the_walkway_is_one_piece(number):
    layout = lay.layout(number)
    # Flood over a 5 cm raster from the robot's start: it must reach the finish and the console's checkpoint.
    x, y = np.arange(-2.0, 9.0, 0.05), np.arange(-6.0, 6.0, 0.05)
    free = np.array([[on_walkway(layout, a, b) for b in y] for a in x])
    todo, reached = [(40, 120)], np.zeros_like(free)
    while todo:
        i, j = todo.pop()
        if free[i, j] and not reached[i, j]:
            reached[i, j] = True
            todo += [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
    for px, py, _ in (layout.finish, lay.checkpoint_1(layout.dish)):
        assert reached[round((px + 2.0) / 0.05), round((py + 6.0) / 0.05)]
    # Nothing but the walkway is left: it has no second piece.
    assert (reached == free).all()


def test_a_bend_is_the_published_hexagon():
    first, second = lay._tile((0.0, 0.0, 0.0), "right")
    corners = {(0.0, 0.762), (1.0776, 0.762), (1.8395, -0.0002), (0.7619, -1.0778), (0.446, -0.762), (0.0, -0.762)}
    # Corners of mesh src_walkway_metal_45 (x forward here): inside by 1 mm is on the bend, outside by 3 mm is not.
    for x, y in sorted(corners):
        middle = np.array([0.72, -0.2])
        out = (np.array([x, y]) - middle) / np.hypot(x - middle[0], y - middle[1])
        for shift, there in ((-0.002, True), (0.003, False)):
            px, py = np.array([x, y]) + shift * out
            hits = []
            for slab in (first, second):
                u, v, _ = lay.compose(lay.inverse(slab.pose), (px, py, 0.0))
                hits.append(abs(u) <= slab.half_along_m and abs(v) <= slab.half_across_m)
            assert any(hits) == there


POSE = st.tuples(*(st.floats(-10.0, 10.0) for _ in range(3)))


@given(POSE, POSE)
def test_inverse_undoes_compose(a, b):
    # Sums of terms up to 30: rounding stays far below 1e-9.
    assert lay.compose(lay.inverse(a), lay.compose(a, b)) == pytest.approx(b, abs=1e-9)
