"""The chain against closed forms. All are met to rounding: 1e-12 of the figure."""

from __future__ import annotations

import math
import pickle

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.core.errors import BadInput
from teleop_sim.machines.chances import Alternative, Chances
from teleop_sim.machines.declare import (
    FELL,
    Concurrence,
    Counter,
    Edge,
    Group,
    Machine,
    Row,
    Rule,
    State,
)
from teleop_sim.machines.markov import Figure, forecast

SURE = 1e-12


def close(value):
    return pytest.approx(value, rel=SURE, abs=SURE)


def exact(figure: Figure) -> float:
    assert figure.low == figure.high
    return figure.low


def tries(rows: tuple[Row, ...] = (), threshold: int = 0) -> Machine:
    """One state that succeeds, fails and tries again, or gives up to a person who stops."""
    return Machine(
        name="tries",
        start="try",
        states=(State("try", "try", rows), State("done"), State("help", manual=True)),
        edges=(
            Edge("try", "good", "done", threshold),
            Edge("try", "bad", "try", 0, "retry"),
            Edge("try", "off", "help", 0, "failed"),
            Edge("help", "stop", "done", 3, "command"),
        ),
        ends=frozenset({"done"}),
    )


def table(p_good: float, good_s: float = 2.0, bad_s: float = 3.0, sd_s: float = 0.0) -> Chances:
    return Chances(
        {"try": (Alternative("good", p_good, good_s, sd_s), Alternative("bad", 1.0 - p_good, bad_s, sd_s))},
        {("manual", ""): (Alternative("stop", 1.0, 10.0),)},
    )


@pytest.mark.parametrize("p", [0.05, 0.5, 0.9])
def test_retries_without_a_counter_are_geometric(p):
    found = forecast(tries(), table(p, sd_s=0.5), 3)
    failures = (1.0 - p) / p
    assert exact(found.visits["try"]) == close(1.0 / p)
    assert exact(found.time_s) == close(2.0 + 3.0 * failures)
    # The failures' number varies by q/p², and each of the 1/p times by 0.5².
    assert exact(found.sd_s) == close(math.sqrt(9.0 * (1.0 - p) / p**2 + 0.25 / p))
    assert exact(found.completed) == close(1.0)
    assert exact(found.manual) == 0.0


@pytest.mark.parametrize("limit", [0, 1, 7, 40])
def test_counted_retries_are_cut_off_geometric(limit):
    q = 0.7
    found = forecast(tries((Row("bad", (Counter(limit, "bad"),), "off"),)), table(1.0 - q), 3)
    fails = q ** (limit + 1)
    assert [exact(found.manual), exact(found.not_completed)] == close([fails, fails])
    assert exact(found.visits["try"]) == close((1.0 - fails) / (1.0 - q))
    assert exact(found.visits["help"]) == close(fails)
    assert exact(found.waits_s) == close(10.0 * fails)
    # Every attempt but the success costs 3 s.
    attempts = (1.0 - fails) / (1.0 - q)
    assert exact(found.time_s) == close(2.0 * (1.0 - fails) + 3.0 * (attempts - (1.0 - fails)) + 10.0 * fails)


COUNTERS = st.builds(Counter, st.integers(0, 3), st.just("bad"), st.booleans(), st.booleans())


def attempts(counters: list[Counter]) -> int:
    """Failures until all counters are full, and one more: what is passed over and clears fills anew each time."""
    first, anew = 0, 0
    for counter in counters:
        each = counter.limit * (1 + anew)
        first, anew = first + each, anew + each * counter.clears
    return first + 1


@given(st.lists(COUNTERS, min_size=1, max_size=3), st.floats(0.05, 0.95))
@settings(max_examples=50, deadline=None)
def test_counters_are_full_after_their_attempts(counters, q):
    row = Row("bad", tuple(counters), "off")
    found = forecast(tries((row,)), table(1.0 - q), 3)
    assert exact(found.manual) == close(q ** attempts(counters))
    assert row.attempts == attempts(counters)


def walk(n: int, p: float) -> tuple[Machine, Chances]:
    """A gambler with 1 to n-1 coins; he is in the middle at first."""
    names = [str(k) for k in range(n + 1)]
    states = tuple(State(k, k if k not in (names[0], names[-1]) else "") for k in names)
    edges = tuple(Edge(names[k], word, names[k + d], 0) for k in range(1, n) for word, d in (("win", 1), ("lose", -1)))
    machine = Machine("ruin", names[n // 2], states, edges, frozenset({names[0], names[-1]}))
    play = (Alternative("win", p, 1.0), Alternative("lose", 1.0 - p, 1.0))
    return machine, Chances(dict.fromkeys(names[1:-1], play))


@pytest.mark.parametrize("p", [0.5, 0.4, 0.55])
@pytest.mark.parametrize("n", [4, 10, 31])
def test_gamblers_ruin(n, p):
    """Feller, An Introduction to Probability Theory, vol. 1, 3rd ed., chapter XIV, (2.4), (2.5), (3.4), (3.5)."""
    found = forecast(*walk(n, p), 3)
    k, r = n // 2, (1.0 - p) / p
    wins = k / n if p == 0.5 else (1.0 - r**k) / (1.0 - r**n)
    plays = k * (n - k) if p == 0.5 else k / (1.0 - 2.0 * p) - n / (1.0 - 2.0 * p) * wins
    # The differences of near numbers in the formula lose a digit.
    assert exact(found.chance_of(str(n))) == pytest.approx(wins, rel=1e-11)
    assert exact(found.time_s) == pytest.approx(plays, rel=1e-11)


def test_the_drunkards_walk_of_kemeny_and_snell():
    """Finite Markov Chains, section 3.2: N of the walk on five corners, its middle row."""
    found = forecast(*walk(4, 0.5), 3)
    assert [exact(found.visits[k]) for k in "123"] == close([1.0, 2.0, 1.0])
    # Theorem 3.3.5: variance of the steps, (2N - I) t - t²; t = (3, 4, 3).
    assert exact(found.sd_s) == close(math.sqrt(2 * (1.0 * 3 + 2.0 * 4 + 1.0 * 3) - 4 - 16))


def test_a_suggestion_waits_and_a_refused_one_is_tried_again():
    answers = {
        ("confirm", ""): (
            Alternative("confirm", 0.6, 20.0),
            Alternative("reject", 0.3, 5.0),
            Alternative("off", 0.1, 7.0),
        ),
        ("manual", ""): (Alternative("stop", 1.0, 10.0),),
    }
    chances = Chances({"try": (Alternative("good", 1.0, 2.0),)}, answers)
    found = forecast(tries(threshold=2), chances, 2)
    rounds = 1.0 / 0.7
    assert exact(found.waits_s) == close(rounds * (0.6 * 20.0 + 0.3 * 5.0 + 0.1 * 7.0) + 10.0 / 7.0)
    assert exact(found.time_s) == close(rounds * (2.0 + 14.2) + 10.0 / 7.0)
    assert [exact(found.manual), exact(found.not_completed)] == close([1.0 / 7.0] * 2)
    assert exact(found.completed_s) == close(22.0 + 7.0 * 0.3 / 0.7)
    assert exact(forecast(tries(threshold=2), chances, 3).time_s) == 2.0


def test_what_ends_otherwise():
    falls = Chances({"try": (Alternative("good", 0.75, 2.0), Alternative(FELL, 0.25, 4.0))})
    found = forecast(tries(), falls, 3)
    assert exact(found.chance_of("not recoverable")) == 0.25
    assert exact(found.time_s) == close(2.5)
    assert exact(found.completed_s) == close(2.0)
    alone = forecast(tries(), Chances({"try": (Alternative("off", 1.0, 4.0),)}), 3)
    assert exact(alone.chance_of("nobody answers")) == 1.0
    for_ever = forecast(tries(), Chances({"try": (Alternative("bad", 1.0, 4.0),)}), 3)
    assert exact(for_ever.chance_of("goes on for ever")) == 1.0
    assert exact(for_ever.time_s) == exact(for_ever.visits["try"]) == math.inf


def both(finish: str) -> Machine:
    left, right = State("left", "left"), State("right", "right")
    edges = (Edge("left", "ok", "", 0), Edge("left", "no", "", 0, "failed"), Edge("right", "ok", "", 0))
    rules = (Rule("ok", (("left", "ok"), ("right", "ok"))),) if finish != "any" else (Rule("ok", (("left", "ok"),)),)
    pair = Concurrence("pair", (left, right), edges, ("ok", "no"), finish, rules, "no")
    ways = (Edge("pair", "ok", "done", -1), Edge("pair", "no", "failed", -1))
    return Machine("both", "pair", (pair,), ways, outcomes=("done", "failed"), goals=frozenset({"done"}))


RACE = Chances(
    {
        "pair/left": (Alternative("ok", 0.5, 2.0), Alternative("ok", 0.2, 6.0), Alternative("no", 0.3, 4.0)),
        "pair/right": (Alternative("ok", 0.9, 3.0), Alternative("ok", 0.1, 5.0)),
    }
)


def test_of_concurrent_states_the_last_counts():
    found = forecast(both("all"), RACE, 3)
    mean_s = sum(
        a.chance * b.chance * max(a.mean_s, b.mean_s)
        for a in RACE.programs["pair/left"]
        for b in RACE.programs["pair/right"]
    )
    assert exact(found.time_s) == close(mean_s)
    assert exact(found.completed) == close(0.7)
    assert exact(found.time_in_s["pair/left"]) == close(0.5 * 2.0 + 0.2 * 6.0 + 0.3 * 4.0)


def test_of_racing_states_the_first_counts():
    found = forecast(both("any"), RACE, 3)
    pairs = [(a, b) for a in RACE.programs["pair/left"] for b in RACE.programs["pair/right"]]
    assert exact(found.time_s) == close(sum(a.chance * b.chance * min(a.mean_s, b.mean_s) for a, b in pairs))
    wins = sum(a.chance * b.chance for a, b in pairs if a.what == "ok" and a.mean_s < b.mean_s)
    assert exact(found.completed) == close(wins)


def test_times_that_race_must_be_fixed():
    varies = Chances(RACE.programs | {"pair/left": (Alternative("ok", 1.0, 2.0, 0.5),)})
    with pytest.raises(BadInput, match="pair/left: ok: its time varies"):
        forecast(both("all"), varies, 3)


def test_a_container_of_priority_stops_what_runs_beside_it():
    """It comes after 1 s for 4 s; what it stops, 3 s long, begins anew afterwards: 1 + 4 + 3 s."""
    urgent = Group("urgent", "act", (State("act", "act"),), (Edge("act", "ok", "ok", 0),), ("ok",), priority=True)
    states = (State("wait", "wait"), urgent)
    side = Group("side", "wait", states, (Edge("wait", "ok", "urgent", 0), Edge("urgent", "ok", "ok", -1)), ("ok",))
    edges = (Edge("work", "ok", "", 0), Edge("side", "ok", "", -1))
    pair = Concurrence("pair", (State("work", "work"), side), edges, ("ok",), "all", (), "ok")
    machine = Machine("m", "pair", (pair,), (Edge("pair", "ok", "done", -1),), outcomes=("done",))
    times_s = {"pair/work": 3.0, "pair/side/wait": 1.0, "pair/side/urgent/act": 4.0}
    found = forecast(machine, Chances({path: (Alternative("ok", 1.0, t),) for path, t in times_s.items()}), 3)
    assert exact(found.time_s) == close(8.0)
    assert exact(found.time_in_s["pair/work"]) == close(4.0)


def test_a_table_that_does_not_fit_is_refused_at_once():
    bad = Chances(
        {"try": (Alternative("god", 0.5), Alternative("bad", 0.4, -1.0)), "tri": ()},
        {("ask", ""): (), ("manual", "help"): (Alternative("confirm", 1.0),)},
    )
    with pytest.raises(BadInput) as caught:
        forecast(tries(), bad, 3)
    text = str(pickle.loads(pickle.dumps(caught.value)))
    assert all(part in text for part in ("'god'", "-1.0 s", "add up to 0.9", "'tri'", "'ask'", "'confirm'"))
    with pytest.raises(BadInput, match="try: the state can be reached"):
        forecast(tries(), Chances({}), 3)
    with pytest.raises(BadInput, match="autonomy level"):
        forecast(tries(), table(0.5), 4)


def test_a_forecast_reads_as_a_table():
    text = str(forecast(tries(), table(0.5), 3))
    assert "time         5 s" in text
    assert "try" in text
    assert str(Figure(1.0, 2.0)) == "1.5 ± 0.5"
