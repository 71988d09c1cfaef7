"""Workload, open requests and the age of belief: closed forms, sampling, and the operators' own measure."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.core.records import MessageEnded, OperatorActed, PacketEnded, Released, Requested, RunEnded
from teleop_sim.operators.workload import utilisation
from teleop_sim.reports.belief_age import PICTURES, mean_s, quantile_s, teeth
from teleop_sim.reports.intervals import length_s
from teleop_sim.reports.workload import at_station, at_work, roles, shares, waiting

NAN = math.nan


def packet(sent_s, arrived_s, topic="mirror", outcome="delivered"):
    end_s = arrived_s if outcome == "delivered" else NAN
    waits = (0.0, 0.0, 0.0, arrived_s - sent_s)
    return PacketEnded(arrived_s, "down", 0, topic, 6, 48, sent_s, sent_s, end_s, *waits, outcome, "", "")


def message(sent_s, delivered_s, topic="mirror"):
    waits = (0.0, 0.0, 0.0, delivered_s - sent_s, 0.0)
    return MessageEnded(delivered_s, "down", 0, topic, 6, sent_s, delivered_s, *waits, 1, "delivered", "", "")


def act(start_s, end_s, kind="read", request=0, role="supervisor"):
    return OperatorActed(end_s, start_s, role, kind, request, "")


# The age of information.


@pytest.mark.parametrize(("period_s", "delay_s"), [(10.0, 10.0), (10.0, 0.25), (3.0, 40.0)])
def test_updates_at_regular_times_over_a_steady_delay(period_s, delay_s):
    """Age runs evenly from the delay to delay and period: all figures in closed form."""
    count = 50
    saw = teeth([packet(i * period_s, i * period_s + delay_s) for i in range(count)], count * period_s + delay_s)
    assert mean_s(saw) == pytest.approx(delay_s + period_s / 2)
    for share in (0.05, 0.5, 0.95, 1.0):
        assert quantile_s(saw, share) == pytest.approx(delay_s + share * period_s)


def test_random_updates_at_once_have_the_mean_of_a_poisson_process():
    """Zero delay, exponential gaps: E[age] is E[gap^2] / (2 E[gap]), the gaps' mean (Kaul, Yates, Gruteser 2012)."""
    times = np.cumsum(np.random.default_rng(3).exponential(5.0, 40_000))
    saw = teeth([packet(float(t), float(t)) for t in times], float(times[-1]))
    # 40,000 gaps: the mean of their squares is known to 1.1 % (one sigma).
    assert mean_s(saw) == pytest.approx(5.0, rel=0.04)


UPDATES = st.lists(
    st.tuples(st.floats(0.0, 80.0), st.floats(0.0, 30.0)).map(lambda pair: (pair[0], pair[0] + pair[1])), max_size=12
)


@given(UPDATES, st.floats(0.02, 1.0))
def test_the_saw_is_the_age_at_every_instant(updates, share):
    end_s = 100.0
    updates = [u for u in updates if u[1] < end_s]
    saw = teeth([packet(*u) for u in updates], end_s)
    if not updates:
        assert (saw, mean_s(saw), quantile_s(saw, 0.5)) == ([], None, None)
        return
    first_s = min(t_s for _, t_s in updates)
    # Midpoints of a fine grid; an age is known to half its step.
    n = 2000
    step_s = (end_s - first_s) / n
    instants = first_s + step_s * (np.arange(n) + 0.5)
    ages = np.array([t - max(sent for sent, arrived in updates if arrived <= t) for t in instants])
    starts, ends = np.array([t.start_s for t in saw]), np.array([t.end_s for t in saw])
    at = np.searchsorted(ends, instants, side="right")
    np.testing.assert_allclose(np.array([t.age_s for t in saw])[at] + instants - starts[at], ages, atol=1e-9)
    # A jump of the saw within a step is misjudged by no more than it is high, once each.
    assert mean_s(saw) == pytest.approx(float(ages.mean()), abs=step_s + 100.0 * (len(updates) + 1) / n)
    share_below = np.mean(ages <= quantile_s(saw, share) + 1e-9)
    assert share_below >= share - (len(updates) + 2) / n


def test_what_comes_late_changes_nothing_and_topics_can_be_chosen():
    run = [
        packet(0.0, 1.0),
        packet(4.0, 6.0),
        packet(2.0, 7.0),
        packet(5.0, 9.0, "image"),
        packet(8.0, 9.5, "x", "dropped"),
    ]
    assert [(t.start_s, t.end_s, t.age_s) for t in teeth(run, 12.0)] == [
        (1.0, 6.0, 1.0),
        (6.0, 9.0, 2.0),
        (9.0, 12.0, 4.0),
    ]
    assert [(t.start_s, t.age_s) for t in teeth(run, 12.0, PICTURES)] == [(9.0, 4.0)]
    # Where messages are logged their copies are not counted.
    assert [(t.start_s, t.age_s) for t in teeth([*run, message(1.0, 11.0)], 12.0)] == [(11.0, 10.0)]


# Workload.

ACTS = st.lists(st.tuples(st.floats(0.0, 60.0), st.floats(0.0, 8.0)), max_size=10)


@given(ACTS, st.sampled_from([7.0, 30.0, 200.0]))
def test_windows_hold_what_the_operators_own_measure_says(gaps, step_s):
    acts, at_s = [], 0.0
    for wait_s, took_s in gaps:
        acts.append(act(at_s + wait_s, at_s + wait_s + took_s))
        at_s = acts[-1].t_s
    end_s = max(at_s, 1.0)
    edges, busy = shares(at_work(acts, "supervisor"), end_s, step_s)
    assert edges[-1] == end_s
    for a, b, share in zip(edges, edges[1:], busy, strict=False):
        assert share == pytest.approx(utilisation(acts, a, b), abs=1e-9)


def test_roles_are_in_their_order_and_people_side_by_side_count_once():
    acts = [act(0.0, 4.0, role="immersed"), act(2.0, 6.0, role="supervisor"), act(8.0, 9.0, role="cook")]
    assert roles(acts) == ["supervisor", "immersed", "cook"]
    assert length_s(at_work(acts)) == 7.0
    assert length_s(at_work(acts, "immersed")) == 4.0


def test_a_request_waits_from_its_arrival_until_its_answer_was_sent():
    run = [
        Requested(0.0, 1, "confirm", "A", "e", ""),
        packet(0.0, 10.0, "request"),
        act(12.0, 14.0, "decide", 1),
        act(14.0, 15.0, "send", 1),
        Released(25.0, 1, "", "answered", ""),
        Requested(30.0, 2, "confirm", "B", "e", ""),  # its packet is lost, the next report shows that it is open
        packet(30.0, 40.0, "request", "dropped"),
        act(50.0, 52.0, "decide", 2),
        act(52.0, 53.0, "send", 2),
        act(70.0, 71.0, "send", 2),  # again
        Released(81.0, 2, "", "answered", ""),
        Requested(90.0, 3, "confirm", "C", "e", ""),  # nobody ever hears of it
        Requested(95.0, 4, "confirm", "D", "e", ""),  # nobody gets to it
        packet(95.0, 97.0, "request"),
        RunEnded(100.0, "censored", "", NAN, 2, 3),
    ]
    assert at_station(run) == [(10.0, 15.0), (50.0, 71.0), (97.0, 100.0)]
    assert waiting(run) == ((0.0, 10.0, 15.0, 50.0, 71.0, 97.0, 100.0), (0, 1, 0, 1, 0, 1, 0))
    assert waiting([]) == ((0.0,), (0,))
