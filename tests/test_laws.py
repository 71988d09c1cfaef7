"""The laws of ``tests/laws.py`` on whole runs of different kinds, and on logs that were made to break them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import teleop_sim
from teleop_sim.channel import messages as msg
from teleop_sim.core import records as rec
from teleop_sim.log.writer import LogWriter
from teleop_sim.run import _Bench, _Watch, run_scenario

Script = Sequence[tuple[float, msg.Message]]

NEAR = {"link.up.delay_s": 0.0, "link.up.rate_bps": 1e6, "link.down.delay_s": 0.0, "world.layout": 1}
"""A command acts within a millisecond of its time."""

RUNS: dict[str, dict[str, object]] = {
    # Every outcome waits for a person, over a thin link that goes dark.
    "asking": {
        "autonomy": "off", "time_limit_s": 150.0, "pacing": "eager", "link.up.delay_s": 1.0,
        "link.up.rate_bps": 80.0, "link.up.blackouts": [[8.0, 19.5], [19.5, 22.0], [60.0, 61.0]],
        "link.down.delay_s": 2.5, "link.down.rate_bps": 300.0, "link.down.blackouts": [[0.0, 4.0], [30.0, 41.0]],
    },
    # The robot falls.
    "slippery": {"world.floor_friction": [0.06, 0.06], "time_limit_s": 60.0, "link.down.rate_bps": 50.0},
    # A hand at work, past checkpoint 2.
    "turning": {"time_limit_s": 140.0, "pacing": "eager", "world.layout": 1},
}  # fmt: skip


def told(overrides: dict[str, object], script: Script, out: Path, seed: int = 1) -> list[rec.Record]:
    """Run with a second person at the control station, who sends ``script`` whatever happens; the log's records."""
    scenario = teleop_sim.load_scenario("src-dish", overrides)
    writer = LogWriter(out / "told.mcap")
    watch = _Watch(scenario, writer.write, None)
    bench = _Bench(scenario, seed, 0, watch, lambda: 0.0)

    def person() -> Any:
        for at_s, message in script:
            yield bench.env.timeout(at_s - bench.env.now)
            topic, payload = msg.encode_message(message)
            bench.up.send(topic, payload, str(message))
            watch(rec.OperatorActed(bench.env.now, bench.env.now, "tester", "send", 0, str(message)))

    bench.env.process(person())
    bench.run()
    writer.close()
    return list(teleop_sim.load(out / "told.mcap").records())


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[rec.Record]]:
    out = tmp_path_factory.mktemp("laws")
    runs = {name: run_scenario(teleop_sim.load_scenario("src-dish", o), 1, out / name) for name, o in RUNS.items()}
    return {name: list(teleop_sim.load(result.log).records()) for name, result in runs.items()}


@pytest.mark.parametrize("name", RUNS)
def test_a_run_keeps_every_law(name: str, logs: dict[str, list[rec.Record]], laws: ModuleType) -> None:
    assert laws.broken_laws(logs[name]) == []


def test_the_runs_show_what_they_are_for(logs: dict[str, list[rec.Record]]) -> None:
    def seen(name: str, kind: type[rec.Record], **fields: object) -> bool:
        return any(isinstance(r, kind) and vars(r).items() >= fields.items() for r in logs[name])

    assert seen("asking", rec.Released, effect="answered")
    assert seen("asking", rec.TransitionTaken, how="confirmed")
    assert seen("asking", rec.Blackout, direction="up")
    assert seen("slippery", rec.RunEnded, outcome="failed")
    assert seen("slippery", rec.PacketEnded, outcome="in_flight")
    assert seen("turning", rec.EpisodeEnded, skill="follow")
    assert seen("turning", rec.Scored, checkpoint=2)


def test_a_fall_names_its_physical_cause(logs: dict[str, list[rec.Record]]) -> None:
    end = logs["slippery"][-1]
    assert isinstance(end, rec.RunEnded)
    assert end.cause.startswith("fell: a standing foot slid")
    fall = next(r for r in logs["slippery"] if isinstance(r, rec.EpisodeEnded) and r.outcome == "fell")
    assert (fall.skill, fall.cause) == ("walk", end.cause)


# Each breaks one law in a log that keeps them all; {} changes fields, None leaves the record out.
BREAKS: dict[str, tuple[str, Callable[[Any], bool], dict[str, Any] | None]] = {
    "times_never_go_back": ("asking", lambda r: isinstance(r, rec.EpisodeEnded), {"t_s": -1.0}),
    "every_packet_ends_once": ("asking", lambda r: isinstance(r, rec.PacketEnded) and r.packet == 2, None),
    "sent_is_what_the_sites_said": ("asking", lambda r: isinstance(r, rec.TransitionTaken), None),
    "waits_of_a_packet_add_up": ("asking", lambda r: isinstance(r, rec.PacketEnded), {"queue_s": 3.0}),
    "nothing_arrives_early": (
        "asking", lambda r: isinstance(r, rec.PacketEnded) and r.outcome == "delivered", {"arrived_s": 0.1},
    ),
    "bits_go_out_in_the_light_and_one_packet_at_a_time": (
        "asking", lambda r: isinstance(r, rec.PacketEnded) and r.direction == "down", {"service_s": 1.0},
    ),
    "blackouts_are_those_of_the_scenario": ("asking", lambda r: isinstance(r, rec.Blackout), None),
    "answers_are_to_open_requests": (
        "asking", lambda r: isinstance(r, rec.Released) and r.effect == "answered", {"request": 77},
    ),
    "round_trips_and_acts_are_counted": ("asking", lambda r: isinstance(r, rec.RunEnded), {"round_trips": 99}),
    "the_operator_is_not_telepathic": (
        "asking", lambda r: isinstance(r, rec.OperatorActed) and r.request == 1, {"start_s": 0.0},
    ),
    "the_field_obeys_what_arrives_and_when": ("asking", lambda r: isinstance(r, rec.Released), None),
    "transitions_chain": ("turning", lambda r: isinstance(r, rec.TransitionTaken), {"next_state": "STATE_END"}),
    "the_guard_holds": (
        "asking", lambda r: isinstance(r, rec.TransitionTaken) and r.how == "confirmed", {"how": "autonomous"},
    ),
    "modes_are_those_told": ("turning", lambda r: isinstance(r, rec.TransitionTaken), {"mode": "manual"}),
    "episodes_lie_in_their_visit": (
        "turning", lambda r: isinstance(r, rec.EpisodeEnded) and r.skill == "walk", {"start_s": 0.0},
    ),
    "the_robot_does_one_thing_at_a_time": (
        "turning", lambda r: isinstance(r, rec.EpisodeEnded) and r.skill == "walk", {"start_s": 0.0},
    ),
    "motion_is_continuous": (
        "turning", lambda r: isinstance(r, rec.PlantSample) and r.t_s > 20.0, {"pelvis": (9.0,) * 7},
    ),
    "the_dish_waits_for_checkpoint_1": ("turning", lambda r: isinstance(r, rec.Scored), {"text": "nothing"}),
    "wheels_turn_only_by_hand": (
        "turning", lambda r: isinstance(r, rec.EpisodeEnded) and r.skill == "follow", {"skill": "look"},
    ),
    "checkpoints_are_earned": (
        "turning",
        lambda r: isinstance(r, rec.Scored) and r.text.startswith("dish pitch came"),
        {"text": "checkpoint 2: dish pitch held"},
    ),
    "the_end_says_what_happened": ("slippery", lambda r: isinstance(r, rec.RunEnded), {"cause": "fell: it rained"}),
}  # fmt: skip


@pytest.mark.parametrize("law", BREAKS)
def test_a_law_sees_that_it_is_broken(law: str, logs: dict[str, list[rec.Record]], laws: ModuleType) -> None:
    name, where, change = BREAKS[law]
    at = next(i for i, r in enumerate(logs[name]) if where(r))
    before = logs[name][at]
    changed = [] if change is None else [replace(before, **change)]
    story = laws.Story((*logs[name][:at], *changed, *logs[name][at + 1 :]))
    assert list(getattr(laws, law)(story))


# Commands in the middle of everything ---------------------------------------------------------------------------------

CHAT = msg.Chat
INTO_ERROR = (1.0, CHAT("/INIT_FAILED"))

SCRIPTS: dict[str, Script] = {
    "stopped while walking, twice": [(14.0, msg.StopAll()), (14.3, CHAT("|"))],
    "forced while walking": [(14.0, CHAT("/WALK_FAILED")), (14.0, CHAT("/REACHED_PANEL")), (18.0, CHAT("/RESTART"))],
    "stopped while a program waits for the head": [
        INTO_ERROR, (3.0, CHAT("&0 30 0")), (3.5, CHAT("/RESTART")), (3.8, CHAT("_")),
    ],
    "forced while a program waits for the head": [
        INTO_ERROR, (3.0, CHAT("&0 30 0")), (3.5, CHAT("/RESTART")), (3.8, CHAT("/REGULAR")),
    ],
    "nonsense": [(5.0, CHAT("/NO_SUCH")), (5.1, CHAT("$1 2")), (5.2, msg.Confirm(9)), (5.3, CHAT("*0 1 0.1 0 0"))],
}  # fmt: skip


@pytest.mark.parametrize("name", SCRIPTS)
def test_commands_at_any_time_keep_every_law(name: str, laws: ModuleType, tmp_path: Path) -> None:
    records = told(NEAR | {"time_limit_s": 20.0}, SCRIPTS[name], tmp_path)
    assert laws.broken_laws(records) == []
    effects = [r.effect for r in records if isinstance(r, rec.Released)]
    assert len(effects) >= len(SCRIPTS[name])
    if name == "nonsense":
        assert set(effects) == {"ignored"}


def test_a_stop_ends_the_head_movement_and_not_the_program_that_waits_for_it(tmp_path: Path) -> None:
    script = SCRIPTS["stopped while a program waits for the head"]
    records = told(NEAR | {"time_limit_s": 20.0}, script, tmp_path)
    look = next(r for r in records if isinstance(r, rec.EpisodeEnded) and r.skill == "look")
    assert look.outcome == "stopped"
    # Half a second past the stop is time enough for a head to come to rest.
    assert 3.8 < look.t_s < 4.3
    init = [r for r in records if isinstance(r, rec.EpisodeEnded) and r.state == "STATE_INIT" and r.t_s > 1.0]
    assert [r.start_s for r in init] == [look.t_s]


def test_a_stop_after_the_fall_does_not_hide_its_cause(tmp_path: Path) -> None:
    slippery = NEAR | {"world.floor_friction": [0.06, 0.06], "time_limit_s": 40.0}
    fall = _fall(told(slippery, (), tmp_path))
    # In the second in which it comes down.
    for message in (msg.StopAll(), CHAT("/WALK_FAILED")):
        records = told(slippery, [(fall.t_s - 0.5, message)], tmp_path)
        assert _fall(records).cause == fall.cause
        assert _fall(records).t_s < fall.t_s
        assert (_end(records).outcome, _end(records).cause) == ("failed", fall.cause)


def _fall(records: list[rec.Record]) -> rec.EpisodeEnded:
    return next(r for r in records if isinstance(r, rec.EpisodeEnded) and r.outcome == "fell")


def _end(records: list[rec.Record]) -> rec.RunEnded:
    return next(r for r in records if isinstance(r, rec.RunEnded))


def test_a_time_limit_in_mid_walk_knows_the_checkpoint_just_scored(tmp_path: Path) -> None:
    records = told(NEAR | {"time_limit_s": 24.0}, (), tmp_path)
    walk = [r for r in records if isinstance(r, rec.EpisodeEnded)][-1]
    scored = [r for r in records if isinstance(r, rec.Scored) and r.checkpoint == 1]
    assert (walk.skill, walk.outcome) == ("walk", "unfinished")
    assert walk.start_s < scored[0].t_s < 24.0
    assert _end(records).cause.endswith("checkpoint 1 of 4")
