"""Where walking ends: limits that emerge from contacts, friction and torque limits; tables are slow."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Command, Step, Stop, Walk
from teleop_sim.robot.episode import NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.disturbances import Disturbances, Payload, Plate, Push
from teleop_sim.world.plant import Plant

KEY = NoiseKey(1, 0, 1)
NAMES = sorted(ROBOTS)
SHORT = Walk(((0.9, 0.1, 0.3),))


def ends(robot: str, command: Command, what: Disturbances, friction: float = 0.8) -> str:
    spec = ROBOTS[robot]()
    body = Body(spec, Plant(spec.model, BareFloor(friction), disturbances=what))
    episode = perform(body, command, body.standing(), KEY)
    # Nobody is told that a robot on the ground has arrived.
    assert (episode.outcome == "fell") == body.has_fallen()
    return episode.outcome


def pushed(newtons: float, seed: int) -> Disturbances:
    rng = np.random.default_rng(seed)
    a, at_s = rng.uniform(-np.pi, np.pi), rng.uniform(1.5, 4.5)
    return Disturbances(pushes=(Push(at_s, 0.2, (newtons * math.cos(a), newtons * math.sin(a), 0.0)),))


@pytest.mark.parametrize("name", NAMES)
def test_floors_of_a_fifth_hold_and_ice_does_not(name):
    assert ends(name, SHORT, Disturbances(), 0.2) == "reached"
    assert ends(name, SHORT, Disturbances(), 0.02) == "fell"


@pytest.mark.parametrize("name", NAMES)
def test_a_hard_push_throws_it_over(name):
    # 20 N s is a push of 100 N and 0.2 s; this one gives the whole robot about 1 m/s.
    mass_kg = sum(link.mass_kg for link in ROBOTS[name]().model.description.links)
    assert ends(name, SHORT, pushed(5.0 * mass_kg, 1)) == "fell"


@pytest.mark.parametrize("name", NAMES)
def test_legs_without_strength_do_not_carry(name):
    weak = {joint: 0.4 for leg in ROBOTS[name]().legs for joint in leg}
    strong_enough = name == "atlas"  # a hydraulic robot: 890 N m at the knee
    assert (ends(name, SHORT, Disturbances(strength=weak)) == "reached") == strong_enough


def table(title: str, rows: dict[str, list[str]]) -> None:
    print(f"\n{title}")
    for name, cells in rows.items():
        print(f"| {name} | " + " | ".join(cells) + " |")


def count(robot: str, what: list[tuple[Command, Disturbances, float]]) -> int:
    return sum(ends(robot, command, w, friction) == "reached" for command, w, friction in what)


def goals(n: int, seed: int) -> list[Walk]:
    rng = np.random.default_rng(seed)
    drawn = [(rng.uniform(1.0, 2.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)) for _ in range(n)]
    return [Walk(((r * math.cos(a), r * math.sin(a), a + turn),)) for r, a, turn in drawn]


@pytest.mark.slow
def test_by_friction() -> None:
    levels = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
    held = {n: [count(n, [(w, Disturbances(), f) for w in goals(8, 1)]) for f in levels] for n in NAMES}
    table(f"upright of 8 by friction {levels}", {n: [f"{k}/8" for k in row] for n, row in held.items()})
    for row in held.values():
        assert row[-1] == 8
        assert row[0] < 4


@pytest.mark.slow
def test_by_push() -> None:
    levels = (20.0, 50.0, 100.0, 150.0, 200.0, 400.0)
    held = {n: [count(n, [(w, pushed(f, i), 0.8) for i, w in enumerate(goals(8, 2))]) for f in levels] for n in NAMES}
    table(f"upright of 8 by push of 0.2 s {levels} N", {n: [f"{k}/8" for k in row] for n, row in held.items()})
    for name, row in held.items():
        assert row[0] >= 7
        assert row[-1] < 8, name


@pytest.mark.slow
def test_by_bump() -> None:
    levels = (0.005, 0.01, 0.02, 0.03, 0.04)
    held = {}
    for n in NAMES:
        held[n] = []
        for height in levels:
            trials = []
            for i, walk in enumerate(goals(8, 3)):
                x, y, _ = walk.path[0]
                u = np.random.default_rng(i).uniform(0.2, 0.8)
                bump = Plate(u * x, u * y, math.atan2(y, x), 0.15, 0.6, height, 0.8)
                trials.append((walk, Disturbances(plates=(bump,)), 0.8))
            held[n].append(count(n, trials))
    table(f"upright of 8 by bump {levels} m", {n: [f"{k}/8" for k in row] for n, row in held.items()})
    assert all(row[0] >= 7 for row in held.values())


@pytest.mark.slow
def test_by_delay_and_joint_friction() -> None:
    for title, levels, made in (
        ("delay s", (0.02, 0.04, 0.08, 0.12), lambda v: Disturbances(delay_s=v)),
        ("joint friction, share of effort", (0.01, 0.02, 0.05, 0.1), lambda v: Disturbances(joint_friction=v)),
    ):
        held = {n: [count(n, [(w, made(v), 0.8) for w in goals(6, 4)]) for v in levels] for n in NAMES}
        table(f"upright of 6 by {title} {levels}", {n: [f"{k}/6" for k in row] for n, row in held.items()})
        assert all(row[0] >= 5 for row in held.values())


@pytest.mark.slow
def test_moves_with_a_load_and_stops() -> None:
    rows = {}
    for n in NAMES:
        hand = ROBOTS[n]().model.hands[0].palm
        load = Disturbances(payload=Payload(hand, 3.0))
        carried = count(n, [(w, load, 0.8) for w in goals(8, 5)])
        steps = [Step(left_m=0.3), Step(left_m=-0.3), Step(forward_m=-0.25), Step(turn_rad=1.57), Step(turn_rad=-1.57)]
        moved = count(n, [(s, Disturbances(), f) for s in steps for f in (0.4, 0.8)])
        spec, rng, stopped = ROBOTS[n](), np.random.default_rng(6), 0
        body = Body(spec, Plant(spec.model, BareFloor(0.6)))
        for walk in goals(10, 6):
            cut = perform(body, walk, body.standing(), KEY, until_s=float(rng.uniform(1.0, 6.0)))
            stopped += perform(body, Stop(), cut.end, KEY).outcome == "stopped"
        rows[n] = [f"3 kg in a hand {carried}/8", f"moves {moved}/10", f"stops {stopped}/10"]
        assert moved >= 9
        assert stopped >= 9
    table("upright", rows)
