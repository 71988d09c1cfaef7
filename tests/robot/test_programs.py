"""The dish task's programs, driven by hand: what they yield, what they make of the replies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teleop_sim.core.errors import UnknownName
from teleop_sim.machines.declare import FELL
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.robot.commands import (
    CircularAffordance,
    Cloud,
    Detect,
    Follow,
    Grip,
    Look,
    Posture,
    Reach,
    Release,
    Scan,
    Step,
    Walk,
)
from teleop_sim.robot.programs.pacing import pacing, wait_for_poll_s
from teleop_sim.robot.programs.places import after, before, facing_rad, middle, move, stance
from teleop_sim.robot.programs.src_dish import dish_programs
from teleop_sim.robot.programs.steps import AskStatus, Memory, Reply, Say, Show, Wait
from teleop_sim.robot.sightings import ConsoleFix, ConsoleGlimpse, FinishFix
from teleop_sim.robot.templates import CRANK_STANDS, crank_stand

STAND = crank_stand("valkyrie")
# A console 2 m ahead of the start, seen square on.
GLIMPSE = ConsoleGlimpse((2.0, 0.2, 0.8), (2.0, -0.2, 0.8))


def wheel(y):
    return CircularAffordance((2.0, y, 0.81), (-0.5, 0.0, math.sqrt(0.75)), (0.0, 1.0, 0.0), 0.123, 0.082, 0.0)


FIX = ConsoleFix((2.0, 0.0, 0.0), 0.0, wheel(0.2), wheel(-0.2))
FINISH = FinishFix((4.0, 1.0, 0.0), ((1.0, 1.0, 0.0), (4.0, 1.0, 0.0)))
STATUS = {
    "dish_yaw": 0.0,
    "dish_pitch": 0.0,
    "yaw_target": -0.5,
    "pitch_target": 0.6,
    "yaw_ok": 0.0,
    "pitch_ok": 0.0,
    "yaw_done": 0.0,
    "pitch_done": 0.0,
    "tolerance_rad": 0.0873,
}


def cloud(x=0.0):
    return Cloud(np.array([[x, 0.0, 0.0]]), (x, 0.0, 1.7))


def nominal(step):
    """What a robot that does everything right replies. Durations are round figures."""
    match step:
        case Walk() | Step():
            return Reply("reached", "", 0.01 if isinstance(step, Walk) else None, 8.0)
        case Scan():
            return Reply("scanned", "", cloud(), 3.927)
        case Detect(what="finish"):
            return Reply("found", "ok", FINISH, 0.0)
        case Detect(stage="coarse"):
            return Reply("found", "ok", GLIMPSE, 0.1)
        case Detect():
            return Reply("found", "ok", FIX, 0.0)
        case Look(duration_s=duration_s):
            return Reply("reached", "", None, duration_s)
        case Posture():
            return Reply("reached", "", None, 2.0)
        case Reach():
            return Reply("reached", "", None, 3.6)
        case Grip():
            return Reply("felt", "", None, 3.1)
        case Follow():
            return Reply("reached", "", None, 11.0)
        case Release():
            return Reply("released", "", None, 4.0)
        case AskStatus():
            return STATUS | {"pitch_ok": 1.0, "pitch_done": 1.0, "yaw_ok": 1.0, "yaw_done": 1.0}
        case _:
            return None


class Run:
    """One run of a program: its steps, its time and its event."""

    def __init__(self, state, memory, answer=nominal, preset="wpi", robot="valkyrie"):
        self.steps, self.time_s = [], 0.0
        self.memory = memory
        program = dish_programs(pacing(preset), robot)[state](memory)
        reply = None
        while True:
            try:
                step = program.send(reply)
            except StopIteration as end:
                self.event = end.value
                return
            self.steps.append(step)
            reply = answer(step)
            self.time_s += step.seconds if isinstance(step, Wait) else getattr(reply, "duration_s", 0.0)

    def of(self, kind):
        return [s for s in self.steps if isinstance(s, kind)]

    def commands(self):
        return [type(s).__name__ for s in self.steps if not isinstance(s, Wait | Say | Show | AskStatus)]


def but(**replies):
    """The nominal answers but for some commands, by name: one reply, or a list of which each is used once."""
    queues = {name: list(r) if isinstance(r, list) else [r] for name, r in replies.items()}

    def answer(step):
        queue = queues.get(type(step).__name__.lower())
        if not queue:
            return nominal(step)
        return queue.pop(0) if len(queue) > 1 else queue[0]

    return answer


def failed(outcome, cause="no", data=None, duration_s=1.0):
    return Reply(outcome, cause, data, duration_s)


def whole_way(preset="wpi"):
    """Run state after state from the start to the end; status as the turning goes on."""
    machine, memory, state, runs = src_dish(), Memory(), "STATE_PRE_INIT", []
    done = dict(STATUS)

    def answer(step):
        if isinstance(step, AskStatus):
            return dict(done)
        if isinstance(step, Follow):
            axis = step.signal.removeprefix("dish_")
            done.update({step.signal: step.target, f"{axis}_ok": 1.0, f"{axis}_done": 1.0})
        return nominal(step)

    while state != "STATE_END":
        run = Run(state, memory, answer, preset)
        runs.append((state, run))
        state = machine.edge(state, run.event).next_state
    return runs


def test_every_state_that_acts_has_a_program():
    states = {s.name for s in src_dish().states if s.program}
    assert set(dish_programs(pacing("wpi"))) == states


@pytest.mark.parametrize("preset", ["wpi", "eager"])
def test_the_nominal_way_visits_each_state_once(preset):
    runs = whole_way(preset)
    assert [s for s, _ in runs] == [
        "STATE_PRE_INIT",
        "STATE_INIT",
        "STATE_DETECT_PANEL_COARSE",
        "STATE_WALK_TO_SEE_PANEL",
        "STATE_DETECT_HANDLE_CENTER",
        "STATE_DETECT_PANEL_FINE",
        "STATE_WALK_TO_PANEL",
        "STATE_FIX_HANDLE_DETECTION",
        "STATE_GRASP_PITCH_HANDLE",
        "STATE_CORRECT_PITCH",
        "STATE_GRASP_YAW_HANDLE",
        "STATE_CORRECT_YAW",
        "STATE_DETECT_FINISH",
        "STATE_WALK_TO_FINISH",
    ]


def test_lines_are_as_long_as_wpis_were():
    lines = [s.text for _, run in whole_way() for s in run.of(Say)]
    assert all(40 <= len(line) <= 120 and line.isascii() for line in lines)


def test_no_foot_moves_while_a_hand_is_at_a_handle():
    held = False
    for _, run in whole_way():
        for step in run.steps:
            assert not (held and isinstance(step, Walk | Step | Posture))
            held = (held or isinstance(step, Reach)) and not isinstance(step, Release)
    assert not held


def test_fixed_waits_overlap_motion_where_wpi_slept_meanwhile():
    # Reach and grip take 6.7 s here and are filled up to 9.3 s; a walk of 8 s is longer than its 4 s.
    memory = Memory({"fix": FIX, "pose": stance(FIX, "right", STAND), "place": (0.9, 0.0, 0.0)})
    assert Run("STATE_GRASP_PITCH_HANDLE", memory).time_s == pytest.approx(9.3)
    assert Run("STATE_WALK_TO_SEE_PANEL", memory).time_s == pytest.approx(8.0 + 1.0)
    short = but(walk=Reply("reached", "", 0.0, 2.5))
    assert Run("STATE_WALK_TO_SEE_PANEL", memory, short).time_s == pytest.approx(4.0 + 1.0)
    assert Run("STATE_WALK_TO_SEE_PANEL", memory, short, "eager").time_s == pytest.approx(2.5)
    assert Run("STATE_INIT", Memory()).time_s == pytest.approx(3.6)


def test_a_side_step_is_made_when_the_other_hand_is_needed():
    memory = Memory({"fix": FIX, "pose": stance(FIX, "right", STAND)})
    run = Run("STATE_GRASP_YAW_HANDLE", memory)
    [step] = run.of(Step)
    # The wheels are 0.4 m apart and each is turned from 0.27 m aside: 2 * 0.27 - 0.4.
    assert (step.forward_m, step.left_m, step.turn_rad) == pytest.approx((0.0, -0.14, 0.0), abs=1e-9)
    assert memory.facts["pose"] == pytest.approx(stance(FIX, "left", STAND))
    assert memory.facts["holding"] == ("left", FIX.yaw_handle)
    far = Run("STATE_GRASP_YAW_HANDLE", Memory({"fix": FIX, "pose": (0.0, 1.0, 3.0)}))
    assert far.of(Walk) == [Walk((stance(FIX, "left", STAND),))]


def test_a_hand_that_feels_nothing_lets_go_and_looks_again_before_the_next_try():
    memory = Memory({"fix": FIX, "pose": stance(FIX, "right", STAND)})
    run = Run("STATE_GRASP_PITCH_HANDLE", memory, but(grip=failed("not_felt", "only 1.0 N against the tug")))
    assert run.event == "/GRASP_PITCH_HANDLE_RETRY"
    assert run.commands() == ["Reach", "Grip", "Release"]
    assert memory.facts["holding"] is None
    assert Run("STATE_GRASP_PITCH_HANDLE", memory).commands()[:2] == ["Scan", "Detect"]


def test_a_handle_out_of_reach_is_not_gripped():
    memory = Memory({"fix": FIX, "pose": stance(FIX, "right", STAND)})
    run = Run("STATE_GRASP_PITCH_HANDLE", memory, but(reach=failed("no_plan")))
    assert (run.event, run.commands()) == ("/GRASP_PITCH_HANDLE_RETRY", ["Reach", "Release"])


@pytest.mark.parametrize(("target", "direction"), [(0.6, -1), (-0.15, 1)])
def test_clockwise_turning_increases_the_angle(target, direction):
    memory = Memory({"holding": ("right", FIX.pitch_handle)})
    wrong = STATUS | {"pitch_target": target}
    right = wrong | {"pitch_ok": 1.0, "pitch_done": 1.0}
    run = Run("STATE_CORRECT_PITCH", memory, but(askstatus=[wrong, right, right]))
    [follow] = run.of(Follow)
    assert (follow.direction, follow.signal, follow.target) == (direction, "dish_pitch", target)
    assert follow.time_limit_s == 13.4
    assert run.event == "/PITCH_CORRECTION_SUCESSFUL"
    # 11 s of turning, 4 s of letting go (more than the posture's 3.6 s), 5.2 s of hold.
    assert run.time_s == pytest.approx(11.0 + 4.0 + 5.2)


def test_eager_lets_go_while_the_axis_is_held():
    memory = Memory({"holding": ("right", FIX.pitch_handle)})
    right = STATUS | {"pitch_ok": 1.0, "pitch_done": 1.0}
    assert Run("STATE_CORRECT_PITCH", memory, but(askstatus=right), "eager").time_s == pytest.approx(5.2)


@pytest.mark.parametrize("outcome", ["grip_lost", "no_motion", "timed_out", "no_plan", "cut"])
def test_a_turn_that_fails_lets_go_and_goes_back_to_detection(outcome):
    memory = Memory({"holding": ("right", FIX.pitch_handle)})
    run = Run("STATE_CORRECT_PITCH", memory, but(askstatus=STATUS, follow=failed(outcome)))
    assert run.event == "/PITCH_CORRECTION_RETRY"
    assert run.commands() == ["Follow", "Release"]


def test_a_time_out_is_counted_where_the_limit_is_one():
    memory = Memory({"holding": ("left", FIX.yaw_handle)})
    late = but(askstatus=STATUS, follow=failed("timed_out"))
    assert Run("STATE_CORRECT_YAW", memory, late, "eager").event == "!timed_out"


def test_in_tolerance_but_not_held_stays_in_the_state():
    near = STATUS | {"pitch_ok": 1.0}
    run = Run("STATE_CORRECT_PITCH", Memory(), but(askstatus=near))
    assert (run.event, run.commands()) == ("/PITCH_CORRECTION_EXECUTING", [])


def test_a_dish_that_leaves_its_tolerance_is_tried_again():
    near = STATUS | {"pitch_ok": 1.0}
    assert Run("STATE_CORRECT_PITCH", Memory(), but(askstatus=[near, STATUS])).event == "/PITCH_CORRECTION_RETRY"
    assert Run("STATE_CORRECT_PITCH", Memory(), but(askstatus=STATUS)).event == "/PITCH_CORRECTION_RETRY"
    assert Run("STATE_CORRECT_PITCH", Memory(), but(askstatus={})).event == "/PITCH_CORRECTION_RETRY"


def test_a_pitch_knocked_out_while_yaw_was_turned_is_redone():
    memory = Memory({"axis": "yaw", "fix": FIX})
    status = STATUS | {"yaw_ok": 1.0, "yaw_done": 1.0}
    assert Run("STATE_CORRECT_YAW", memory, but(askstatus=status)).event == "!pitch_disturbed"
    assert Run("STATE_REDETECT_HANDLE", memory).event == "/REDETECTED_HANDLE_GRASP_PITCH"


@pytest.mark.parametrize("axis", ["pitch", "yaw"])
def test_redetection_goes_back_to_the_axis_that_was_interrupted(axis):
    memory = Memory({"fix": FIX, "pose": stance(FIX, "right", STAND)})
    Run(f"STATE_GRASP_{axis.upper()}_HANDLE", memory)
    run = Run("STATE_REDETECT_HANDLE", memory)
    assert run.event == f"/REDETECTED_HANDLE_GRASP_{axis.upper()}"
    assert run.commands() == ["Release", "Posture", "Scan", "Detect"]
    # Letting go and the posture take 6 s, more than the reset's 3.6 s; then the sweep, then 2 s for the arms.
    assert run.time_s == pytest.approx(6.0 + 3.927 + 2.0)


def test_redetection_that_sees_nothing_tries_again():
    memory = Memory({"fix": FIX})
    assert Run("STATE_REDETECT_HANDLE", memory, but(detect=failed("not_found"))).event == "/REDETECT_HANDLE_RETRY"
    assert memory.facts["fix"] is FIX


def test_coarse_detection_needs_two_sightings_and_walks_to_a_place_before_the_console():
    memory = Memory()
    once = but(detect=[Reply("found", "ok", GLIMPSE, 0.1), failed("not_found", duration_s=0.1)])
    assert Run("STATE_DETECT_PANEL_COARSE", memory, once).event == "/DETECT_PANEL_RETRY"
    assert Run("STATE_DETECT_PANEL_COARSE", memory).event == "/DETECTED_PANEL"
    assert memory.facts["place"] == pytest.approx((0.9, 0.0, 0.0))


def test_without_a_plane_fit_the_two_wheels_tell_the_heading():
    memory = Memory()
    seen = Reply("found", "ok", GLIMPSE, 0.1)
    Run("STATE_DETECT_PANEL_COARSE", memory, but(detect=[seen, seen, failed("not_found")]))
    assert memory.facts["place"] == pytest.approx((0.9, 0.0, 0.0))


def test_only_the_first_five_coarse_retries_sleep():
    memory = Memory()
    times = [Run("STATE_DETECT_PANEL_COARSE", memory, but(detect=failed("not_found"))) for _ in range(7)]
    sleeps = [any(w.why == "retry" for w in run.of(Wait)) for run in times]
    assert sleeps == [True] * 5 + [False] * 2
    assert len({run.of(Look)[0].yaw_rad for run in times}) == 3


def test_a_place_that_held_nothing_is_avoided_once():
    memory = Memory({"glimpse": GLIMPSE})
    blind = but(detect=failed("not_found"))
    assert Run("STATE_DETECT_HANDLE_CENTER", memory, blind).event == "/DETECT_HANDLE_RETRY"
    run = Run("STATE_DETECT_PANEL_COARSE", memory, blind)
    assert run.of(Detect)[0].avoid == (middle(GLIMPSE),)
    assert Run("STATE_DETECT_PANEL_COARSE", memory, blind).of(Detect)[0].avoid == ()


def test_a_place_that_held_the_console_is_not_doubted():
    memory = Memory({"glimpse": GLIMPSE, "doubted": GLIMPSE})
    assert Run("STATE_DETECT_HANDLE_CENTER", memory).event == "/DETECTED_HANDLE"
    assert Run("STATE_DETECT_PANEL_COARSE", memory).of(Detect)[0].avoid == ()


def test_fine_detection_makes_as_many_sweeps_as_the_pacing_says():
    assert len(Run("STATE_DETECT_PANEL_FINE", Memory({"glimpse": GLIMPSE})).of(Scan)) == 2
    assert len(Run("STATE_DETECT_PANEL_FINE", Memory({"glimpse": GLIMPSE}), preset="eager").of(Scan)) == 1
    assert Run("STATE_DETECT_PANEL_FINE", Memory()).event == "/DETECT_PANEL_FINE_RETRY"


def test_handles_not_seen_from_the_stance_leave_the_earlier_fix():
    memory = Memory({"fix": FIX})
    assert Run("STATE_FIX_HANDLE_DETECTION", memory, but(detect=failed("not_found"))).event == "/FIX_RETRY"
    assert memory.facts["fix"] is FIX


@pytest.mark.parametrize(
    ("state", "facts", "event"),
    [
        ("STATE_WALK_TO_SEE_PANEL", {"place": (0.9, 0.0, 0.0)}, "/WALK_RETRY"),
        ("STATE_WALK_TO_SEE_PANEL", {}, "/WALK_RETRY"),
        ("STATE_WALK_TO_PANEL", {"fix": FIX}, "/WALK_TO_PANEL_RETRY"),
        ("STATE_WALK_TO_PANEL", {}, "/WALK_TO_PANEL_RETRY"),
        ("STATE_WALK_TO_FINISH", {"finish": FINISH}, "/WALK_TO_FINISH_RETRY"),
        ("STATE_WALK_TO_FINISH", {}, "/WALK_TO_FINISH_RETRY"),
    ],
)
@pytest.mark.parametrize("walk", [Reply("reached", "", 0.11, 5.0), Reply("cut", "stopped", None, 5.0)])
def test_a_walk_that_stops_short_is_tried_again(state, facts, event, walk):
    memory = Memory(dict(facts))
    assert Run(state, memory, but(walk=walk)).event == event
    assert "visited" not in memory.facts


def test_the_finish_is_looked_for_in_all_sweeps_and_not_where_the_robot_stood():
    memory = Memory({"at_console": True, "pose": (1.4, 0.0, 1.0), "clouds": {(9, 9): cloud(4.5)}})
    run = Run("STATE_DETECT_FINISH", memory)
    assert run.commands() == ["Look", "Step", "Step", "Scan", "Detect", "Posture"]
    assert [s.turn_rad for s in run.of(Step)] == [0.0, -1.0]
    [detect] = run.of(Detect)
    assert len(detect.cloud.points) == 2
    assert detect.visited[0] == (0.0, 0.0, 0.0)
    assert run.event == "/DETECT_FINISH_SUCESSFUL"
    again = Run("STATE_DETECT_FINISH", memory, but(detect=failed("not_found")))
    assert (again.event, again.of(Step)) == ("/DETECT_FINISH_RETRY", [])


def test_a_restart_at_the_console_steps_back_first():
    memory = Memory({"at_console": True, "holding": ("right", FIX.pitch_handle)})
    assert Run("STATE_INIT", memory).commands() == ["Release", "Step", "Posture"]
    assert Run("STATE_INIT", memory).commands() == ["Posture"]


def test_the_skip_is_refused():
    assert Run("STATE_SKIP_TO_CP3", Memory()).event == "/SKIP_CP3_FAILED"


@pytest.mark.parametrize("state", sorted(dish_programs(pacing("eager"))))
def test_a_fall_ends_any_program_at_once(state):
    everything = {"fix": FIX, "glimpse": GLIMPSE, "place": (0.9, 0.0, 0.0), "finish": FINISH}
    memory = Memory(everything | {"holding": ("right", FIX.pitch_handle)})
    answered = Run(state, memory, lambda s: STATUS if isinstance(s, AskStatus) else Reply("fell", "toppled", None, 1.0))
    acts = answered.commands()
    assert (answered.event == FELL and len(acts) == 1) or not acts


def test_events_and_signals_are_all_known_to_the_machine():
    machine = src_dish()
    for state, run in whole_way():
        assert machine.has_edge(state, run.event)


def test_the_place_faces_the_console_whatever_its_heading():
    for yaw_rad in np.linspace(-3.0, 3.0, 7):
        f, right = (math.cos(yaw_rad), math.sin(yaw_rad)), (math.sin(yaw_rad), -math.cos(yaw_rad))
        glimpse = ConsoleGlimpse(
            (1.0 - 0.2 * right[0], 2.0 - 0.2 * right[1], 0.8), (1.0 + 0.2 * right[0], 2.0 + 0.2 * right[1], 0.8)
        )
        assert facing_rad(glimpse) == pytest.approx(yaw_rad)
        assert before(1.0, 2.0, yaw_rad, 1.1) == pytest.approx((1.0 - 1.1 * f[0], 2.0 - 1.1 * f[1], yaw_rad))


def test_a_step_leads_where_it_was_made_for():
    here, goal = (0.3, -1.0, 2.5), (0.5, -1.2, -3.0)
    assert after(here, move(here, goal)) == pytest.approx(goal)


@pytest.mark.parametrize("robot", sorted(CRANK_STANDS))
def test_the_wheel_is_where_the_hand_can_turn_it(robot):
    stand = crank_stand(robot)
    for side, handle in (("right", FIX.pitch_handle), ("left", FIX.yaw_handle)):
        wheel_at = move(stance(FIX, side, stand), (*handle.centre[:2], 0.0))
        aside_m = -stand.aside_m if side == "right" else stand.aside_m
        assert (wheel_at.forward_m, wheel_at.left_m) == pytest.approx((stand.ahead_m, aside_m))


@pytest.mark.parametrize("robot", sorted(CRANK_STANDS))
def test_each_robot_walks_to_its_own_stand(robot):
    run = Run("STATE_WALK_TO_PANEL", Memory({"fix": FIX}), robot=robot)
    assert [walk.path for walk in run.of(Walk)] == [(stance(FIX, "right", crank_stand(robot)),)]


def test_a_robot_without_a_stand_is_refused():
    with pytest.raises(UnknownName, match="Known: valkyrie, atlas"):
        dish_programs(pacing("wpi"), "asimo")


@pytest.mark.parametrize(
    ("spent_s", "poll_s", "wait_s"),
    [(0.0, 1.0, 0.0), (2.3, 1.0, 0.7), (3.0, 1.0, 0.0), (0.1 * 3 * 10, 1.0, 0.0), (2.3, 0.0, 0.0)],
)
def test_the_end_of_a_state_is_noticed_at_the_next_look(spent_s, poll_s, wait_s):
    assert wait_for_poll_s(spent_s, poll_s) == pytest.approx(wait_s, abs=1e-8)


def test_an_unknown_pacing_is_refused():
    with pytest.raises(UnknownName, match="Known: wpi, eager"):
        pacing("lazy")


def test_eager_waits_for_nothing_but_the_hold():
    waits = [s.why for _, run in whole_way("eager") for s in run.of(Wait)]
    assert set(waits) == {"hold"}
