"""Trials at the valve: put the shut hand between two spokes as a rod, turn the wheel by a whole turn, draw back.

python benchmarks/valve_study.py [--robots atlas thormang3] [--trials 20] [--errors 0 1 2 4] [--friction 2 4] [--say]

Drawn: the robot's stance (2 cm, 3 degrees), friction of the wheel's surface 0.4 to 1, of its bearing as told, angle of
its spokes. The template is off by a normal error in each direction, 1 degree a centimetre in yaw, and in the spokes'
angle by as much at the rim. Done is: turned by 345 degrees and more; the robot stands. Truth is asked only after the
end. A hand that lost touch turns on from where it is; a blocked one tries the gap before; three tries in all.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from functools import partial

import numpy as np
from drc_trials import SIDE, TOOL, Runner, Trial, believed, stand_error, study

from teleop_sim.robot.commands import Act, LetGo, Take
from teleop_sim.robot.drc_plans import drc_stand, gap_handle, wheel_turn
from teleop_sim.world.valve import HEIGHT_M, RADIUS_M, SPOKES, Valve, turned_rad

WANTED_RAD = math.radians(345.0)
TRIES = 3


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


def tried(robot: str, error_m: float, seed: int, friction_nm: tuple[float, float], say: bool = False) -> Trial:
    """One trial."""
    rng = np.random.default_rng((seed, 73))
    valve = valve_of(robot, friction_nm, rng)
    at = believed(valve.place, valve.yaw_rad, error_m, rng)
    spoke_rad = valve.start_rad + float(rng.normal()) * error_m / RADIUS_M
    run = Runner(robot, valve, seed)
    told, tries, stand = "blocked", 0, drc_stand(robot)
    while told == "blocked" and tries < TRIES:
        told = run.do(Take(SIDE, gap_handle(at, spoke_rad, stand), shut=True)).outcome
        stand, tries = replace(stand, start_rad=stand.start_rad - math.tau / SPOKES), tries + 1
    if told == "taken":
        left, tries = math.tau, 0
        while tries < TRIES:
            act = run.do(Act(SIDE, wheel_turn(at), left, TOOL))
            told, tries = act.outcome, tries + 1
            if told != "grip_lost":
                break
        if told != "fell":
            run.do(LetGo(SIDE, shut=True))
    if say:
        print(f"  {seed}, {valve.friction_nm:.1f} N m: " + "\n     ".join(run.said))
    turned = turned_rad(run.body.plant)
    good = turned > WANTED_RAD and not run.state.fallen
    return Trial(seed, good, "" if good else "fell" if run.state.fallen else told, turned, run.moved_s)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=["atlas", "thormang3"])
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--errors", nargs="+", type=float, default=[0.0, 1.0, 2.0, 4.0], help="cm")
    parser.add_argument("--friction", nargs=2, type=float, default=[2.0, 5.0], help="N m")
    parser.add_argument("--say", action="store_true")
    told = parser.parse_args()
    low, high = told.friction
    seeds = range(told.first, told.first + told.trials)
    errors_m = [e / 100 for e in told.errors]
    study(partial(tried, friction_nm=(low, high), say=told.say), told.robots, errors_m, seeds)


if __name__ == "__main__":
    main()
