"""Trials at the valve: put the shut hand between two spokes as a rod, turn the wheel by a whole turn, draw back.

python benchmarks/valve_study.py [--robots atlas thormang3] [--trials 20] [--errors 0 1 2 4] [--friction 2 4]
    [--parts] [--say]

Drawn: the robot's stance (2 cm, 3 degrees), friction of the wheel's surface 0.4 to 1, of its bearing as told, angle of
its spokes. The template is off by a normal error in each direction, 1 degree a centimetre in yaw, and in the spokes'
angle by as much at the rim. Done is: turned by 345 degrees and more; the robot stands. Truth is asked only after the
end. A blocked hand tries the next gap, three in all; one that found nothing to push yet turns on; where the arm ends,
the rod slips out or nothing moves, the hand comes again, three grips in all.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from drc_trials import SIDE, TOOL, InParts, Runner, Trial, believed, stand_error, study

from teleop_sim.robot.commands import Act, LetGo, Take
from teleop_sim.robot.drc_plans import DrcStand, Template, drc_stand, gap_handle, wheel_turn
from teleop_sim.robot.episode import Episode
from teleop_sim.world.valve import HEIGHT_M, RADIUS_M, SPOKES, Valve, turned_rad

WANTED_RAD, ASKED_RAD = math.radians(345.0), math.radians(370.0)
"""Asked for is what the published templates' affordance has (team-vigir/vigir_templates @8fc2e9b, ``DRC_valve``)."""
GRIPS, GAPS = 3, 3
LEAST_RAD, SEEK_RAD = math.radians(10.0), 0.5
"""What is left undone at the end; as far as a rod goes in its gap before it touches."""
FIRM: dict[str, Any] = {"give_way_n": 15.0, "braced": True}
FORCE_N = {"atlas": 100.0, "thormang3": 50.0}
"""Of the wrist: what each is told to stop at."""


def valve_of(robot: str, friction_nm: tuple[float, float], rng: np.random.Generator) -> Valve:
    """The valve where it stands; all draws are made whatever the setting."""
    dx, dy, dyaw = stand_error(rng)
    x, y = drc_stand(robot).valve
    grip, friction, start = rng.uniform(0.0, 1.0, 3)
    low, high = friction_nm
    return Valve(
        place=(float(x + dx), float(y + dy), HEIGHT_M),
        yaw_rad=float(dyaw),
        friction_nm=low + (high - low) * float(friction),
        start_rad=float(start) * math.tau / SPOKES,
        grip=0.4 + 0.6 * float(grip),
    )


def turn(run: Runner, at: Template, spoke_rad: float, stand: DrcStand, limit_n: float) -> str:
    """Take, turn as far as the arm goes, let go, and again until it has gone all the way. Return what ended it."""
    left, told = ASKED_RAD, ""
    for _ in range(GRIPS):
        told = enter(run, at, spoke_rad, stand)
        if told != "taken":
            return told
        act = stroke(run, at, left, limit_n)
        if act.outcome == "grip_lost" and act.data.amount < SEEK_RAD:
            act = stroke(run, at, left, limit_n)
        told, went = act.outcome, act.data.amount if act.data else 0.0
        if told == "fell":
            return told
        run.do(LetGo(SIDE, shut=True))
        left, spoke_rad = left - went, spoke_rad + went
        if left < LEAST_RAD:
            return told
    return told


def enter(run: Runner, at: Template, spoke_rad: float, stand: DrcStand) -> str:
    """Put the hand into a gap, or into the next where there is no way in."""
    told = ""
    for gap in range(GAPS):
        near = replace(stand, start_rad=stand.start_rad + gap * math.tau / SPOKES)
        told = run.do(Take(SIDE, gap_handle(at, spoke_rad, near), shut=True)).outcome
        if told not in ("blocked", "no_plan"):
            break
    return told


def stroke(run: Runner, at: Template, left: float, limit_n: float) -> Episode:
    """One turn of what is left, or of as much of it as is in reach."""
    act = run.do(Act(SIDE, wheel_turn(at), left, TOOL, limit_n, **FIRM))
    if act.outcome == "no_plan" and act.data is not None and act.data.reach > LEAST_RAD:
        return run.do(Act(SIDE, wheel_turn(at), 0.95 * act.data.reach, TOOL, limit_n, **FIRM))
    return act


def tried(
    robot: str, error_m: float, seed: int, friction_nm: tuple[float, float], say: bool = False, parts: bool = False
) -> Trial:
    """One trial."""
    rng = np.random.default_rng((seed, 73))
    valve = valve_of(robot, friction_nm, rng)
    at = believed(valve.place, valve.yaw_rad, error_m, rng)
    spoke_rad = valve.start_rad + float(rng.normal()) * error_m / RADIUS_M
    run = (InParts if parts else Runner)(robot, valve, seed)
    told = turn(run, at, spoke_rad, drc_stand(robot), FORCE_N[robot])
    if say:
        print(f"  {seed}, {valve.friction_nm:.1f} N m: " + "\n     ".join(run.said))
    turned = turned_rad(run.body.plant)
    good = turned > WANTED_RAD and not run.state.fallen
    return Trial(seed, good, "" if good else "fell" if run.state.fallen else told, turned, run.moved_s)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=["atlas", "thormang3"])
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--first", type=int, default=400)
    parser.add_argument("--errors", nargs="+", type=float, default=[0.0, 1.0, 2.0, 4.0], help="cm")
    parser.add_argument("--friction", nargs=2, type=float, default=[2.0, 5.0], help="N m")
    parser.add_argument("--parts", action="store_true", help="PreGrasp, Grasp and Fingers for Take")
    parser.add_argument("--say", action="store_true")
    told = parser.parse_args()
    low, high = told.friction
    seeds = range(told.first, told.first + told.trials)
    errors_m = [e / 100 for e in told.errors]
    study(partial(tried, friction_nm=(low, high), say=told.say, parts=told.parts), told.robots, errors_m, seeds)


if __name__ == "__main__":
    main()
