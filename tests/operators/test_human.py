"""Slips, misjudgements and load: rates are kept, and nothing else changes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from teleop_sim.channel.messages import Chat, Confirm, Reject, SetLevel, StopAll, encode_message
from teleop_sim.core.errors import BadInput
from teleop_sim.operators.human import MISJUDGE_RATE, SLIP_RATE, Human, happens, misjudged, slipped
from teleop_sim.operators.workload import Curve, Load


@pytest.mark.parametrize("rate", [0.0, SLIP_RATE, MISJUDGE_RATE, 1.0])
def test_things_go_wrong_at_their_rate(rate):
    rng = np.random.default_rng(1)
    wrong = sum(happens(rate, rng) for _ in range(20_000))
    # Four standard errors of a binomial.
    assert wrong / 20_000 == pytest.approx(rate, abs=4.0 * math.sqrt(rate * (1.0 - rate) / 20_000) + 1e-12)


@pytest.mark.parametrize(
    ("meant", "came"),
    [
        (Confirm(3), Reject(3)),
        (Reject(3), Confirm(3)),
        (SetLevel(1), SetLevel(2)),
        (SetLevel(3), SetLevel(2)),
        (Chat("/RESTART"), Chat("/ERSTART")),
        (StopAll(), StopAll()),
    ],
)
def test_a_slip_sends_the_neighbour_and_can_be_sent(meant, came):
    assert slipped(meant) == came
    assert encode_message(slipped(meant))


def test_a_misjudgement_is_about_suggestions():
    assert misjudged((Confirm(1), Chat("/RESTART"))) == (Reject(1), Chat("/RESTART"))


@pytest.mark.parametrize("rates", [(-0.1, 0.0), (0.0, 1.1), (math.nan, 0.0)])
def test_no_chance_is_refused(rates):
    with pytest.raises(BadInput, match="no chance"):
        Human(*rates)


def test_load_is_the_busy_share_of_the_window():
    load = Load(Curve(window_s=100.0))
    load.note(0.0, 50.0)
    assert load.utilisation(50.0) == pytest.approx(0.5)
    assert load.utilisation(100.0) == pytest.approx(0.5)
    assert load.utilisation(120.0) == pytest.approx(0.3)
    load.note(120.0, 140.0)
    assert load.utilisation(150.0) == pytest.approx(0.2)
    assert load.utilisation(300.0) == 0.0


def test_nobody_gets_worse_below_the_ceiling_and_everybody_above():
    curve = Curve(window_s=100.0)
    for busy_s, strained in ((0.0, 0.0), (70.0, 0.0), (85.0, 0.25), (100.0, 1.0)):
        load = Load(curve)
        load.note(0.0, busy_s)
        assert load.slowing(100.0) == pytest.approx(1.0 + curve.slowing * strained)
        assert load.erring(100.0) == pytest.approx(1.0 + curve.erring * strained)


def test_a_curve_can_be_flat():
    load = Load(replace(Curve(), slowing=0.0, erring=0.0))
    load.note(0.0, 300.0)
    assert load.slowing(300.0) == load.erring(300.0) == 1.0
