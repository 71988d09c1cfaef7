"""Table robots, crews, ways and the driver, on small machines worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
import simpy

from teleop_sim.core.errors import BadInput, UnknownName
from teleop_sim.machines.chances import CONFIRM, REJECT, Alternative, Chances
from teleop_sim.machines.clocked import on_clock
from teleop_sim.machines.declare import FELL, Machine
from teleop_sim.machines.drive import drive
from teleop_sim.machines.elements import INHERIT, Concurrence, Counter, Edge, Group, Row, Rule, State
from teleop_sim.machines.stub import (
    Reply,
    Scripted,
    absent_crew,
    confirming_crew,
    drawn_crew,
    drawn_robot,
    nominal_robot,
    starter,
)
from teleop_sim.machines.visits import Start
from teleop_sim.machines.ways import way

TRY = Machine(
    "try",
    "work",
    (State("work", "work", (Row("again", (Counter(3, "again"),), "lost"),)), State("end"), State("help", manual=True)),
    (
        Edge("work", "ok", "end", 0),
        Edge("work", "again", "work", 1, "retry"),
        Edge("work", "lost", "help", 2, "failed"),
        Edge("help", "retry", "work", 3, "command", "operator"),
        Edge("help", "stop", "end", 3, "command", "operator"),
    ),
    frozenset({"end"}),
)

BOTH = Machine(
    "both",
    "arms",
    (
        Concurrence(
            "arms",
            (State("left", "move"), State("right", "move")),
            tuple(Edge(s, e, "", 1, k) for s in ("left", "right") for e, k in (("ok", "done"), ("stuck", "failed"))),
            ("finished", "failed"),
            "map",
            (Rule("failed", (("left", "stuck"),)), Rule("failed", (("right", "stuck"),))),
            "finished",
        ),
    ),
    (Edge("arms", "finished", "finished", INHERIT), Edge("arms", "failed", "failed", 2, "failed")),
    outcomes=("finished", "failed"),
    goals=frozenset({"finished"}),
)


def script(**replies):
    return Scripted({path: tuple(steps) for path, steps in replies.items()}, lambda *_: Reply("ok"))


def test_a_scripted_robot_gives_its_replies_in_order_and_the_last_one_again():
    robot = script(work=(Reply("again", 1.0), Reply("ok", 2.0)))
    assert [robot("work", "p").what for _ in range(3)] == ["again", "ok", "ok"]
    assert script(p=(Reply("lost"),))("elsewhere", "p") == Reply("lost"), "by program where no path is named"
    assert robot("other", "q") == Reply("ok")


def test_times_add_up_and_the_counter_is_hit():
    # Three retries pass at full, the fourth failure is lost (kind failed, high): help, retry, then three more and stop.
    crew = confirming_crew(TRY, {"help": "stop"}, time_s=5.0)
    run = drive(TRY, 3, script(work=(Reply("again", 2.0),)), crew)
    assert [TRY.table[e].event for e in run.taken] == ["again", "again", "again", "lost", "stop"]
    assert (run.end, run.state, run.time_s, run.answers) == ("failed", "end", 4 * 2.0 + 5.0, 1)


def test_a_suggestion_that_is_rejected_works_again():
    answers = iter((REJECT, REJECT, CONFIRM))
    run = drive(TRY, 0, script(work=(Reply("ok", 3.0),)), lambda *_: Reply(next(answers), 1.0))
    assert (run.end, run.time_s, run.answers, len(run.taken)) == ("completed", 12.0, 3, 1)


def test_a_person_may_force_another_outcome_than_the_suggested_one():
    run = drive(
        TRY, 0, script(work=(Reply("again", 3.0),)), lambda kind, *_: Reply("lost" if kind == "confirm" else "stop")
    )
    assert [TRY.table[e].event for e in run.taken] == ["lost", "stop"]
    with pytest.raises(UnknownName):
        drive(TRY, 0, script(), lambda *_: Reply("lots"))


def test_what_nobody_answers_waits():
    run = drive(TRY, 0, script(work=(Reply("ok", 3.0),)), absent_crew)
    assert (run.end, run.state, run.time_s, run.unanswered) == ("waits", "work", 3.0, ("work",))


def test_a_fall_ends_everything_and_an_unknown_signal_is_refused():
    assert drive(TRY, 3, script(work=(Reply(FELL, 3.0),)), absent_crew).end == "failed"
    with pytest.raises(BadInput, match="does not know"):
        drive(TRY, 3, script(work=(Reply("what"),)), absent_crew)


def test_states_at_work_at_once_take_the_longer_time_and_a_rule_ends_early():
    done = {"arms/left": (Reply("ok", 3.0),), "arms/right": (Reply("ok", 7.0),)}
    assert drive(BOTH, 3, Scripted(done, nominal_robot(BOTH)), absent_crew).time_s == 7.0
    stuck = done | {"arms/left": (Reply("stuck", 3.0),)}
    run = drive(BOTH, 3, Scripted(stuck, nominal_robot(BOTH)), absent_crew)
    assert (run.end, run.state, run.time_s) == ("failed", "failed", 3.0)
    result, ended_s = on_clock(BOTH, 3, Scripted(stuck, nominal_robot(BOTH)), absent_crew, lambda _: None)
    assert (result.outcome, ended_s) == ("failed", 3.0)


def test_a_rejected_container_begins_anew_inside():
    answers = iter((REJECT, CONFIRM))
    run = drive(
        BOTH,
        2,
        Scripted({"arms/left": (Reply("stuck", 3.0),)}, nominal_robot(BOTH, 4.0)),
        lambda *_: Reply(next(answers)),
    )
    assert (run.end, run.time_s) == ("failed", 6.0)


def test_drawn_robots_and_crews_follow_their_chances():
    chances = Chances(
        {"work": (Alternative("ok", 0.25, 2.0), Alternative("lost", 0.75, 4.0))},
        {("manual", "help"): (Alternative("retry", 0.5), Alternative("stop", 0.5))},
    )
    rng = np.random.default_rng(5)
    runs = [drive(TRY, 3, drawn_robot(chances, rng), drawn_crew(chances, rng)) for _ in range(4000)]
    # P(completed) = p / (1 - (1 - p) / 2) with p = 1/4: 0.4; standard error sqrt(0.24 / 4000) = 0.0077, 4 sigma.
    assert np.mean([r.end == "completed" for r in runs]) == pytest.approx(0.4, abs=0.031)
    # Attempts are geometric with 1 - (1 - p) / 2 = 5/8: mean 1.6, each 0.25 * 2 + 0.75 * 4 = 3.5 s: 5.6 s.
    # Its deviation is that of a geometric sum: below 3.5 * 1.6 = 5.6 s; 4 sigma of 4000 runs is 0.36 s.
    assert np.mean([r.time_s for r in runs]) == pytest.approx(5.6, abs=0.36)
    assert drawn_crew(chances, rng)("confirm", "work", "ok") is None


def test_a_stub_program_that_is_interrupted_comes_to_rest():
    env = simpy.Environment()
    begin = starter(env, lambda *_: Reply("ok", 9.0, {"own": 1}))
    first, second = (begin(Start("work", "work", {}, {}, lambda _: env.event())) for _ in range(2))

    def stop():
        yield env.timeout(2.0)
        first.interrupt("enough")

    env.process(stop())
    env.run()
    assert (first.value.signal, first.value.note) == ("", "at rest: enough")
    assert (second.value.signal, second.value.writes) == ("ok", {"own": 1})


def test_the_way_prefers_success_to_detours_and_people_to_nothing():
    assert way(TRY) == {"work": "ok", "help": "retry"}
    assert way(BOTH) == {"arms": "finished", "arms/left": "ok", "arms/right": "ok"}
    inside = Group("box", "a", (State("a", "a"), State("b", "b")), (
        Edge("a", "go", "b", 0), Edge("a", "quit", "gone", 0, "failed"), Edge("b", "go", "done", 0),
    ), ("done", "gone"))  # fmt: skip
    outer = Machine(
        "outer", "box", (inside,), (Edge("box", "done", "good", 0), Edge("box", "gone", "bad", 0, "failed")),
        outcomes=("good", "bad"), goals=frozenset({"good"}),
    )  # fmt: skip
    assert way(outer) == {"box": "done", "box/a": "go", "box/b": "go"}
