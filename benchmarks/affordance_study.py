"""Trials at the bench: pull a slide 0.2 m, turn a wheel by 90 degrees, drive a screw two turns, trace with a held rod.

python benchmarks/affordance_study.py [--robots valkyrie] [--things slide,wheel,screw] [--trials 20] [--errors 0,1,2,4]
python benchmarks/affordance_study.py --study limit      a thing that is stuck, a slide that comes to its end
python benchmarks/affordance_study.py --study strokes    a screw two turns, in strokes with a new grip each
python benchmarks/affordance_study.py --study rod        tip errors of a line and a circle

The robot stands before the bench, the bench off its nominal place by 2 cm and 3 degrees (standard deviations). It takes
the handle where its template says, which is off by a normal error in each direction and 1 degree a centimetre about
each axis; then one ``Act``. Done is: told as reached, truly within ``WITHIN``, upright after letting go.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from teleop_sim.robot.affordance import Affordance, Usability, felt, moved, rotated, strokes
from teleop_sim.robot.body import Body
from teleop_sim.robot.chain_ik import Target, search, two_stage
from teleop_sim.robot.collision import Collisions
from teleop_sim.robot.commands import Act
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.skills.manipulate import (
    JAW_OPEN,
    JAW_SHUT,
    Arm,
    Ticks,
    arm_of,
    follow_path,
    hold,
    move_jaws,
    plan_stance,
    rest_posture,
    straight_path,
)
from teleop_sim.robot.ways import drawn_back, free_way
from teleop_sim.world.bench_scene import ROD_KG, ROD_LENGTH_M, TRAVEL_M, Bench, Thing, amount, rod_tip
from teleop_sim.world.plant import Plant

SIDE = "left"
ASKED: dict[Thing, float] = {"slide": 0.2, "wheel": math.pi / 2, "screw": 4 * math.pi}
WITHIN: dict[Thing, float] = {"slide": 0.02, "wheel": math.radians(10.0), "screw": math.radians(20.0)}
LIFT_M = 0.10
SINK_M = 0.008
STANCE_M, STANCE_RAD = 0.02, math.radians(3.0)
HELD_M = 0.012
"""From the middle of the cage to the handle's: 2 mm play, and what a loaded hand is askew."""
TILT_RAD_M = math.radians(1.0) / 0.01

PLACES: dict[str, dict[Thing, tuple[float, float, float]]] = {
    "valkyrie": {
        "slide": (0.65, 0.30, 0.85),
        "wheel": (0.56, 0.30, 0.81),
        "screw": (0.56, 0.30, 0.81),
        "rod": (0.55, 0.30, 0.90),
    },
    "atlas": {
        "slide": (0.82, 0.25, 0.85),
        "wheel": (0.75, 0.25, 0.81),
        "screw": (0.75, 0.25, 0.81),
        "rod": (0.65, 0.25, 0.90),
    },
    "thormang3": {
        "slide": (0.52, 0.28, 0.70),
        "wheel": (0.45, 0.20, 0.70),
        "screw": (0.45, 0.20, 0.70),
        "rod": (0.42, 0.22, 0.60),
    },
}
"""Where each robot has a bench, from the middle of its feet: found by asking the inverse kinematics."""

RESIST_N = (5.0, 20.0)
"""At the handle."""


@dataclass(frozen=True)
class Setting:
    """One cell of the study."""

    robot: str
    thing: Thing
    error_m: float = 0.0
    resist_n: tuple[float, float] = RESIST_N
    force_limit_n: float = 80.0
    travel_m: float = TRAVEL_M


@dataclass(frozen=True)
class Tried:
    """One trial: what was told, how far the thing truly went and how far it was felt to, forces, time."""

    seed: int
    told: str
    asked: float
    true: float
    felt: float
    peak_n: float
    aside_m: float
    resist_n: float
    duration_s: float
    within: float
    held: bool

    @property
    def done(self) -> bool:
        return self.told == "reached" and abs(self.true - self.asked) <= self.within

    @property
    def why(self) -> str:
        return "" if self.done else (f"{self.told}, thing off" if self.told == "reached" else self.told)


def bench_of(setting: Setting, rng: np.random.Generator) -> Bench:
    """The bench where it stands; all draws are made whatever the setting."""
    dx, dy, dyaw, resist, grip, start = (*rng.normal(0.0, 1.0, 3), *rng.uniform(0.0, 1.0, 3))
    x, y, z = PLACES[setting.robot][setting.thing]
    place = (x + STANCE_M * dx, y + STANCE_M * dy, z)
    low, high = setting.resist_n
    resist_n = low + (high - low) * resist
    bench = Bench(thing=setting.thing, place=place, yaw_rad=STANCE_RAD * dyaw, grip=0.4 + 0.6 * grip)
    force = resist_n if setting.thing == "slide" else resist_n * bench.orbit_m
    start_rad = 0.0 if setting.thing in ("slide", "rod") else float(start) * 2 * math.pi
    if setting.thing == "rod":
        bench = replace(bench, tilt_rad=0.0)
    return replace(bench, resist=float(force), start_rad=start_rad, travel_m=setting.travel_m)


def motion_of(bench: Bench) -> Affordance:
    """How the thing truly moves."""
    axes = bench.axes()
    if bench.thing == "slide":
        way = axes @ np.array([math.cos(bench.way_rad), math.sin(bench.way_rad), 0.0])
        return Affordance("linear", triple(way))
    if bench.thing == "wheel":
        return Affordance("circular", triple(axes[:, 2]), bench.place)
    return Affordance("screw", triple(axes[:, 2]), bench.place, pitch_m=bench.pitch_m)


def mistaken(affordance: Affordance, off: np.ndarray, tilt: np.ndarray) -> Affordance:
    """The affordance of a template that is off by ``off`` [m] and turned by ``tilt`` [rad]."""
    axis = tilted(np.array(affordance.axis), tilt)
    return replace(affordance, axis=triple(axis), origin=triple(np.array(affordance.origin) + off))


def tilted(vector: np.ndarray, tilt: np.ndarray) -> np.ndarray:
    angle = float(np.linalg.norm(tilt))
    return vector if angle == 0.0 else rotated(tilt / angle, angle, vector)


def triple(vector: np.ndarray) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


class Trial:
    """A robot at a bench."""

    def __init__(self, setting: Setting, seed: int) -> None:
        self.setting, self.seed = setting, seed
        self.rng = np.random.default_rng((seed, 71))
        self.bench = bench_of(setting, self.rng)
        spec = ROBOTS[setting.robot]()
        self.body = Body(spec, Plant(spec.model, self.bench))
        self.body.load(self.body.standing())
        self.state = self.body.save()
        self.off = self.rng.normal(0.0, 1.0, 3) * setting.error_m
        self.tilt = self.rng.normal(0.0, 1.0, 3) * setting.error_m * TILT_RAD_M
        self.gone = 0.0
        self.play(hold(self.arm(), 0.6, (0.0, 0.0)))

    def arm(self) -> Arm:
        return arm_of(self.body, SIDE)

    def play(self, ticks: Ticks) -> bool:
        """Ticks outside a command. Returns whether the robot still stands."""
        return all(self.body.tick(reference) for reference in ticks)

    def take(self) -> str:
        """Bring the open hand over the handle, down to it, and close it. Return what went wrong, or nothing."""
        pointing = tilted(-self.bench.axes()[:, 2], self.tilt)
        sink_m = 0.0 if self.setting.thing == "rod" else SINK_M
        handle = self.bench.handle()
        if self.gone:
            handle = moved(motion_of(self.bench), self.gone, handle)
        place = handle + self.off + sink_m * pointing
        self.body.set_stand()
        arm, jaws = self.arm(), (JAW_OPEN, JAW_OPEN)
        now, stance = plan_stance(arm)
        rest = rest_posture(arm, stance)
        target = Target(place, pointing)
        for _, solver in two_stage(arm.kinematics, SIDE, stance, rest):
            found = search(solver, rest, target, np.random.default_rng(0))
            if found.within(0.003, 0.1):
                break
        if not found.within(0.012, 0.3):
            return "no_plan"
        path, _ = straight_path(solver, found.q, target, -LIFT_M * pointing, rows=9)
        back = partial(drawn_back, solver, path[-1])
        way = free_way(Collisions(arm.robot, ()), solver.settle(now), path[-1], rest, back)
        for piece, seconds in ((way.q, 2.0), (path[::-1][1:], 1.5)):
            if not self.play(follow_path(arm, piece[:, arm.upper], seconds, jaws)):
                return "fell"
        done = self.play(hold(arm, 0.3, jaws)) and self.play(move_jaws(arm, JAW_SHUT, 0.6))
        return "" if done and self.play(hold(arm, 0.3, arm.jaws(JAW_SHUT))) else "fell"

    def do(self, command: Act) -> Episode:
        self.body.set_stand()
        episode = perform(self.body, command, self.body.save(), NoiseKey(self.seed, 0, 1))
        self.body.load(episode.end)
        return episode

    def let_go(self) -> bool:
        """Open the hand and draw it back along its approach axis. Returns whether the robot still stands."""
        arm, jaws = self.arm(), (JAW_OPEN, JAW_OPEN)
        if not self.play(move_jaws(arm, JAW_OPEN, 0.5)):
            return False
        now, stance = plan_stance(arm)
        rotation, position = arm.hand()
        target = Target(position, rotation[:, 2])
        _, (_, solver) = two_stage(arm.kinematics, SIDE, stance, rest_posture(arm, stance))
        path, _ = straight_path(solver, now, target, -LIFT_M * rotation[:, 2], rows=9)
        return self.play(follow_path(arm, path[:, arm.upper], 1.5, jaws)) and self.play(hold(arm, 0.3, jaws))

    def in_strokes(self, reach: float) -> Tried:
        """As ``run``, but with a new grip after each stroke; the handle is looked for where it was felt to go."""
        thing, told, peak_n, seconds = self.setting.thing, "reached", 0.0, 0.0
        motion = mistaken(motion_of(self.bench), self.off, self.tilt)
        before = amount(self.body.plant, thing)
        for stroke in strokes(motion, ASKED[thing], reach):
            told = self.take()
            if told:
                break
            episode = self.do(Act(SIDE, motion, stroke))
            told, seconds = episode.outcome, seconds + episode.duration_s
            if told != "reached" or not self.let_go():
                told = "fell" if told == "reached" else told
                break
            self.gone, peak_n = self.gone + episode.data.amount, max(peak_n, episode.data.peak_n)
        true = amount(self.body.plant, thing) - before
        goal, within, resist_n = ASKED[thing], WITHIN[thing], self.resist_n()
        return Tried(self.seed, told, goal, true, self.gone, peak_n, 0.0, resist_n, seconds, within, told == "reached")

    def held(self) -> bool:
        """Whether the handle is between the bars: a hand that came down beside it can still push it along."""
        rotation, position = self.arm().hand()
        knob = self.body.plant.data.geom("benchKnob").xpos
        return math.hypot(*(rotation.T @ (knob - position))[:2]) < HELD_M

    def resist_n(self) -> float:
        """Friction at the handle."""
        return self.bench.resist / (1.0 if self.setting.thing == "slide" else self.bench.orbit_m)

    def run(self) -> Tried:
        setting, thing = self.setting, self.setting.thing
        wanted = ASKED[thing]
        told, felt, peak_n, aside_m, seconds = self.take(), math.nan, math.nan, math.nan, math.nan
        before, held = amount(self.body.plant, thing), False
        if not told:
            motion = mistaken(motion_of(self.bench), self.off, self.tilt)
            episode = self.do(Act(SIDE, motion, wanted, force_limit_n=setting.force_limit_n))
            told, seconds = episode.outcome, episode.duration_s
            if episode.data is not None:
                felt, peak_n, aside_m = episode.data.amount, episode.data.peak_n, episode.data.aside_m
            held = self.held()
        true = amount(self.body.plant, thing) - before
        if told != "fell" and not self.let_go():
            told = "fell"
        within = WITHIN[thing]
        return Tried(self.seed, told, wanted, true, felt, peak_n, aside_m, self.resist_n(), seconds, within, held)


@dataclass(frozen=True)
class Traced:
    """A path of the held rod's tip: as felt at the end, and the tip's true distance from the path [mm]."""

    what: str
    told: str
    amount: float
    mean_mm: float
    worst_mm: float
    end_mm: float


TIP = Usability("tip", (0.0, 0.0, ROD_LENGTH_M), mass_kg=ROD_KG)
CIRCLE_M = 0.08


def traced(robot: str, seed: int) -> list[Traced]:
    """Take the rod, lift it, trace a line of 0.2 m towards the robot and a circle beside it with its tip."""
    trial = Trial(Setting(robot, "rod"), seed)
    if trial.take():
        return []
    toward = -trial.bench.axes()[:, 0]
    rows = [trace(trial, "lift 0.08 m", Affordance("linear", (0.0, 0.0, 1.0)), 0.08)]
    rows.append(trace(trial, "line 0.2 m", Affordance("linear", triple(toward)), 0.2))
    # To the left, where neither rack nor robot is in the rod's way.
    hub = rod_tip(trial.body.plant) + CIRCLE_M * trial.bench.axes()[:, 1]
    rows.append(trace(trial, "circle", Affordance("circular", (0.0, 0.0, 1.0), triple(hub)), 2 * math.pi))
    return rows


def trace(trial: Trial, what: str, affordance: Affordance, wanted: float) -> Traced:
    """One path of the tip, watched in the physics."""
    plant, tips = trial.body.plant, [rod_tip(trial.body.plant)]
    plain = trial.body.tick

    def watched(reference: Tick) -> bool:
        upright = plain(reference)
        tips.append(rod_tip(plant))
        return upright

    trial.body.tick = watched  # type: ignore[method-assign]
    episode = trial.do(Act(SIDE, affordance, wanted, TIP))
    trial.body.tick = plain  # type: ignore[method-assign]
    near, off = 0.0, []
    for tip in tips:
        near, away = felt(affordance, tips[0], tip, near)
        off.append(1e3 * float(np.linalg.norm(away)))
    amount = episode.data.amount if episode.data else math.nan
    unit_mm = 1e3 * (1.0 if affordance.kind == "linear" else CIRCLE_M)
    return Traced(what, episode.outcome, amount, float(np.mean(off)), max(off), abs(near - wanted) * unit_mm)


def tried(setting: Setting, seed: int) -> Tried:
    return Trial(setting, seed).run()


HEAD = (
    "| robot | thing | error cm | done | held | worst miss | felt off | peak N | led aside cm | s | else |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|"
)


def line(setting: Setting, trials: list[Tried]) -> str:
    """One row of the table."""
    done = [t for t in trials if t.done]
    scale, unit = (1e3, "mm") if setting.thing == "slide" else (180.0 / math.pi, "°")
    miss = scale * max((abs(t.true - t.asked) for t in done), default=math.nan)
    off = scale * max((abs(t.felt - t.true) for t in done), default=math.nan)
    peak_n, aside_cm = max((t.peak_n for t in done), default=math.nan), 100 * max((t.aside_m for t in done), default=0)
    seconds = float(np.median([t.duration_s for t in done])) if done else math.nan
    causes = Counter(t.why for t in trials if not t.done)
    told = "; ".join(f"{n} {why}" for why, n in causes.most_common(5))
    return (
        f"| {setting.robot} | {setting.thing} | {100 * setting.error_m:.0f} | {len(done)}/{len(trials)} |"
        f" {sum(t.held for t in done)} | {miss:.1f} {unit} | {off:.1f} {unit} | {peak_n:.0f} | {aside_cm:.1f} |"
        f" {seconds:.0f} | {told} |"
    )


def show_limit(robots: list[str], seeds: range) -> None:
    """Peak force over the limit, where nothing moves and where a slide comes to its end after 10 cm."""
    print("| robot | what | limit N | told | worst over the limit N | truly moved mm |\n|---|---|---|---|---|---|")
    for robot in robots:
        for what in ("stuck", "end"):
            for limit_n in (15.0, 30.0, 60.0):
                setting = Setting(robot, "slide", force_limit_n=limit_n)
                stuck = (
                    {"resist_n": (1000.0, 1000.0)} if what == "stuck" else {"travel_m": 0.1, "resist_n": (5.0, 12.0)}
                )
                trials = [tried(replace(setting, **stuck), seed) for seed in seeds]
                told = ", ".join(f"{n} {why}" for why, n in Counter(t.told for t in trials).most_common())
                over_n, moved_mm = max(t.peak_n for t in trials) - limit_n, 1e3 * max(t.true for t in trials)
                print(f"| {robot} | {what} | {limit_n:.0f} | {told} | {over_n:.1f} | {moved_mm:.1f} |", flush=True)


def show_strokes(robots: list[str], seeds: range) -> None:
    """A screw in four strokes of half a turn."""
    print(HEAD)
    for robot in robots:
        setting = Setting(robot, "screw")
        print(line(setting, [Trial(setting, seed).in_strokes(math.pi) for seed in seeds]), flush=True)


def show_rod(robots: list[str], seeds: range) -> None:
    """Mean and worst distance of the rod's tip from its path."""
    print("| robot | path | reached | mean mm | worst mm | end off mm |\n|---|---|---|---|---|---|")
    for robot in robots:
        found = [row for seed in seeds for row in traced(robot, seed)]
        for what in sorted({row.what for row in found}):
            rows = [row for row in found if row.what == what]
            good = [row for row in rows if row.told == "reached"]
            figures = [(row.mean_mm, row.worst_mm, row.end_mm) for row in good]
            mean, worst, end = float(np.mean([f[0] for f in figures])), *np.max(figures, axis=0)[1:]
            print(f"| {robot} | {what} | {len(good)}/{len(seeds)} | {mean:.1f} | {worst:.1f} | {end:.1f} |", flush=True)


def show_moves(settings: list[Setting], seeds: range, jobs: int) -> None:
    """The table of success against template error."""
    print(HEAD)
    with ProcessPoolExecutor(jobs) as pool:
        for setting in settings:
            print(line(setting, list(pool.map(tried, [setting] * len(seeds), seeds))), flush=True)


def main() -> None:
    """Run a study and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--study", default="moves", choices=("moves", "limit", "strokes", "rod"))
    parser.add_argument("--robots", default=",".join(PLACES))
    parser.add_argument("--things", default="slide,wheel,screw")
    parser.add_argument("--errors", default="0,1,2,4", help="cm")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    told = parser.parse_args()
    robots, seeds = told.robots.split(","), range(told.first_seed, told.first_seed + told.trials)
    if told.study == "moves":
        errors = [float(error) / 100 for error in told.errors.split(",")]
        cells = [Setting(robot, thing, e) for robot in robots for thing in told.things.split(",") for e in errors]
        show_moves(cells, seeds, told.jobs)
    else:
        {"limit": show_limit, "strokes": show_strokes, "rod": show_rod}[told.study](robots, seeds)


if __name__ == "__main__":
    main()
