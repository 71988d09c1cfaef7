"""Utilisation is a pure function of the records."""

import math

import pytest

from teleop_sim.core.records import OperatorActed, Scored
from teleop_sim.operators.workload import acts_sent, utilisation

ACTS = (
    OperatorActed(4.0, 0.0, "supervisor", "decide", 1, "look"),
    OperatorActed(5.0, 4.0, "supervisor", "send", 1, "confirm"),
    Scored(6.0, 1, "not an act"),
    OperatorActed(12.0, 8.0, "supervisor", "read", 0, "line"),
    OperatorActed(9.0, 0.0, "auxiliary", "send", 2, "somebody else"),
)


def test_busy_share_is_the_sum_of_the_acts():
    assert utilisation(ACTS, 0.0, 20.0) == pytest.approx(9.0 / 20.0)


def test_acts_count_with_the_part_inside_the_window():
    assert utilisation(ACTS, 2.0, 10.0) == pytest.approx((2.0 + 1.0 + 2.0) / 8.0)


def test_windows_add_up():
    parts = 7.0 * utilisation(ACTS, 0.0, 7.0) + 13.0 * utilisation(ACTS, 7.0, 20.0)
    assert parts == pytest.approx(20.0 * utilisation(ACTS, 0.0, 20.0))


def test_an_empty_window_has_no_utilisation():
    assert math.isnan(utilisation(ACTS, 3.0, 3.0))


def test_operator_acts_are_what_was_sent():
    assert acts_sent(ACTS) == 2
