"""The lanes of a run: what the machine, the crew, the robot and the link did, each stretch with what it was.

Modelled on Fig. 17 of Romay, Kohlbrecher, Stumpf, von Stryk et al., Collaborative Autonomy Between High-level Behaviors
and Human Operators for Remote Manipulation Tasks using Different Humanoid Robots; its rows and colours are in
``timeline_layers.py``. Pure functions of records.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from teleop_sim.core.records import (
    EpisodeEnded,
    Judged,
    Layer,
    OperatorActed,
    Released,
    Requested,
    Scored,
    TransitionTaken,
    Waited,
)
from teleop_sim.core.units import format_time
from teleop_sim.reports import lanes, timeline, timeline_layers
from teleop_sim.reports.drc_marks import MARKS, marks
from teleop_sim.reports.lane_data import Bar, Kind, Lane, Mark, Row, Step
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.visits import visits

LEVELS = ("off", "low", "high", "full")
"""Levels of autonomy by number."""

_MODES = {
    "normal": Kind("normal", timeline.BLUE),
    "auto": Kind("autonomous recovery", timeline.ORANGE),
    "manual": Kind("manual", timeline.RED),
    "not_recoverable": Kind("not recoverable", "ink"),
}
_WITHIN = Kind("in a container", "#8a8f9680")
_FAMILIES = {
    "walk": "walk, step",
    "see": "look, scan, detect",
    "hand": "reach, grip, release",
    "follow": "follow (turn a handle)",
    "posture": "posture",
    "other": "other",
}
_REQUESTS = (timeline.BLUE, timeline.PINK, timeline.ORANGE, timeline.GREEN, timeline.RED, timeline.SKY)
_HOW = {"autonomous": "passed by itself", "confirmed": "confirmed by the operator", "forced": "forced by the operator"}
_STAR = Kind("checkpoint", timeline.GREEN, "star")
_AXIS = Kind("an axis came into or out of tolerance", "muted", "tick")
_ANSWERS = {
    "answered": Kind("answered", timeline.GREEN, "tick"),
    "level": Kind("level set", "#c2188f", "diamond"),
    "forced": Kind("forced", "ink", "tick"),
    "stopped": Kind("stopped", timeline.RED, "cross"),
}
_OTHER_ANSWER = Kind("other command", "muted", "tick")
_VERDICTS = {
    "accepted": Kind("claim accepted", timeline.GREEN, "circle"),
    "rejected": Kind("claim rejected", timeline.RED, "cross"),
    "unseen": Kind("not to be seen in the picture", "muted", "circle"),
}
_LEVEL = Kind("", timeline.BLUE)


def events(run: Run) -> Lane:
    """Checkpoints, and what the crew did besides confirming."""
    scored = [r for r in run.records if isinstance(r, Scored)]
    news = [new for _, _, new in lanes.scores(run.records)]
    made = [
        Mark(r.t_s, 0, _STAR if new else _AXIS, f"{r.checkpoint}: {r.text}" if new else r.text)
        for r, new in zip(scored, news, strict=True)
    ]
    shapes = {"D": "diamond", "o": "circle", "v": "down", "^": "up"}
    looks = {kind: (shapes[shape], colour) for kind, (shape, colour) in timeline_layers.SHAPES.items()}
    colours = {"black": "ink", "white": "paper", "#00441B": timeline.GREEN, "magenta": "#c2188f"}
    crew = []
    for mark in marks(run.records):
        shape, colour = looks.get(mark.kind, ("tick", "black"))
        crew.append(Mark(mark.t_s, 1, Kind(MARKS[mark.kind], colours.get(colour, colour), shape), mark.layer))
    rows = (Row("checkpoints", height=20), *([Row("crew", height=20)] if crew else []))
    return Lane("events", "Events", rows, marks=(*made, *crew))


def machine(run: Run) -> Lane:
    """The machine's states in the order of first visits, coloured by mode; containers above what is in them."""
    stays = _stays(run)
    spent: dict[str, float] = {}
    for state, bar in stays:
        spent[state] = spent.get(state, 0.0) + bar.end_s - bar.start_s
    nested = any("/" in state for state in spent)
    kept = [state for state, time_s in spent.items() if time_s >= lanes.LEAST_S or not nested]
    paths = list(dict.fromkeys(path for state in kept for path in (*_containers(state), state)))
    order = {path: row for row, path in enumerate(_tree(paths))}
    bars = [Bar(b.start_s, b.end_s, order[state], b.kind, b.text) for state, b in stays if state in order]
    within = [bar for path in order for bar in _spans_within(path, stays, order[path])]
    rows = tuple(Row(_short(path), path.count("/")) for path in order)
    return Lane("machine", "Machine", rows, bars=(*within, *bars))


def _stays(run: Run) -> list[tuple[str, Bar]]:
    """State and bar of each attempt, in order; the row is not known yet."""
    taken = [r for r in run.records if isinstance(r, TransitionTaken)]
    attempts = [(visit.state, attempt) for visit in visits(run.records) for attempt in visit.attempts]
    # One attempt a transition, and the stay in which the log ends.
    open_end = [None] * (len(attempts) - len(taken))
    return [
        (state, Bar(a.start_s, a.end_s, 0, _MODES.get(a.mode, _MODES["normal"]), _transition(state, r)))
        for (state, a), r in zip(attempts, [*taken, *open_end], strict=True)
    ]


def _transition(state: str, taken: TransitionTaken | None) -> str:
    if taken is None:
        return f"{state}\nhere the log ends"
    waited = f" after {format_time(taken.waited_s)}" if taken.waited_s > 0.0 else ""
    lines = [
        state,
        f"{taken.event} → {taken.next_state}",
        f"{_HOW.get(taken.how, taken.how)}{waited}",
        f"level {_level(taken.level)}, threshold {_level(taken.threshold)}" if taken.threshold >= 0 else "",
        f"retries {taken.retries}" if taken.retries else "",
        taken.note,
    ]
    return "\n".join(line for line in lines if line)


def _level(number: int) -> str:
    return LEVELS[number] if 0 <= number < len(LEVELS) else str(number)


def _containers(state: str) -> list[str]:
    parts = state.split("/")
    return ["/".join(parts[:n]) for n in range(1, len(parts))]


def _tree(paths: Sequence[str]) -> list[str]:
    """Each container before what is in it, siblings in the order in which they came."""
    place = {path: i for i, path in enumerate(paths)}
    return sorted(paths, key=lambda path: [place[p] for p in (*_containers(path), path)])


def _short(path: str) -> str:
    return path.split("/")[-1].removeprefix("STATE_")


def _spans_within(path: str, stays: Sequence[tuple[str, Bar]], row: int) -> list[Bar]:
    """When the machine was in a container: one bar for each row of stays in it."""
    inside = groupby(stays, key=lambda stay: stay[0].startswith(f"{path}/"))
    found = []
    for is_in, group in inside:
        spans = [bar for _, bar in group]
        if is_in and spans[-1].end_s > spans[0].start_s:
            found.append(Bar(spans[0].start_s, spans[-1].end_s, row, _WITHIN, path))
    return found


def requests(run: Run) -> Lane:
    """What the field site asked, until the answer arrived, by kind; and every command that arrived there."""
    kinds = sorted({r.kind for r in run.records if isinstance(r, Requested)})
    looks = {kind: Kind(kind, _REQUESTS[i % len(_REQUESTS)]) for i, kind in enumerate(kinds)}
    bars = [Bar(r.t_s, end_s, kinds.index(r.kind), looks[r.kind], _request(r, how)) for r, end_s, how in _asked(run)]
    arrived = [r for r in run.records if isinstance(r, Released)]
    made = [Mark(r.t_s, len(kinds), _ANSWERS.get(r.effect, _OTHER_ANSWER), _released(r)) for r in arrived]
    rows = (*(Row(kind) for kind in kinds), *([Row("commands arrived")] if made else []))
    return Lane("requests", "Requests and answers", rows, bars=tuple(bars), marks=tuple(made))


def _request(asked: Requested, how: str) -> str:
    head = f"request {asked.request}: {asked.kind}" + (f" {asked.event}" if asked.event else "")
    return "\n".join(line for line in (head, asked.state, asked.text, how) if line)


def _released(came: Released) -> str:
    return "\n".join(line for line in (came.command, came.effect, came.note) if line)


def _asked(run: Run) -> list[tuple[Requested, float, str]]:
    """Each request, when it was over, and how: answered, overtaken by a transition, or open at the end."""
    pending: dict[int, Requested] = {}
    found: list[tuple[Requested, float, str]] = []
    for r in run.records:
        if isinstance(r, Requested):
            pending.setdefault(r.request, r)
        elif isinstance(r, TransitionTaken):
            found += [(asked, r.t_s, "the machine moved on") for asked in pending.values()]
            pending.clear()
        elif isinstance(r, Released) and r.effect == "answered" and r.request in pending:
            found.append((pending.pop(r.request), r.t_s, f"answered: {r.command}"))
    return [*found, *((asked, run.end_s, "not answered") for asked in pending.values())]


def operators(run: Run) -> Lane:
    """What each role did, and what it made of the robot's claims."""
    acts = [r for r in run.records if isinstance(r, OperatorActed)]
    roles = list(dict.fromkeys(r.role for r in acts))
    kinds = sorted({r.kind for r in acts})
    others = [kind for kind in kinds if kind not in timeline.ACTS]
    looks = {kind: Kind(kind, colour) for kind, colour in timeline.ACTS.items()}
    looks |= {kind: Kind(kind, timeline.OTHER_ACTS[i % len(timeline.OTHER_ACTS)]) for i, kind in enumerate(others)}
    bars = [Bar(r.start_s, min(r.t_s, run.end_s), roles.index(r.role), looks[r.kind], _act(r)) for r in acts]
    judged = [r for r in run.records if isinstance(r, Judged)]
    made = [Mark(r.t_s, len(roles), _VERDICTS.get(r.verdict, _VERDICTS["unseen"]), _judgement(r)) for r in judged]
    rows = (*(Row(role) for role in roles), *([Row("judgements")] if made else []))
    return Lane("operators", "Operators", rows, bars=tuple(bars), marks=tuple(made))


def _act(act: OperatorActed) -> str:
    about = f"request {act.request}" if act.request else ""
    return "\n".join(line for line in (f"{act.role}: {act.kind}", act.text, about) if line)


def _judgement(judged: Judged) -> str:
    seen = f"off by {judged.offset_px:.3g} px, an eye tells {judged.sigma_px:.3g} px"
    return f"{judged.event}: {judged.verdict}\n{judged.what}" + (f"\n{seen}" if judged.sigma_px > 0.0 else "")


def robot(run: Run) -> Lane:
    """The robot's skills by kind of motion, and its waits."""
    episodes = [r for r in run.records if isinstance(r, EpisodeEnded)]
    family = [lanes.SKILLS.get(r.skill.lower(), "other") for r in episodes]
    names = [name for name in _FAMILIES if name in family]
    looks = {name: Kind(_FAMILIES[name], timeline.SKILLS[name]) for name in names}
    bars = [
        Bar(r.start_s, r.t_s, names.index(name), looks[name], _skill(r))
        for r, name in zip(episodes, family, strict=True)
    ]
    paced = [r for r in run.records if isinstance(r, Waited) and r.kind == "pacing"]
    wait = Kind("pacing wait", "#9a9a9a")
    bars += [Bar(r.start_s, r.t_s, len(names), wait, "\n".join((r.why, r.state))) for r in paced]
    rows = (*(Row(_FAMILIES[name]) for name in names), *([Row("pacing wait")] if paced else []))
    return Lane("robot", "Robot", rows, bars=tuple(bars))


def _skill(done: EpisodeEnded) -> str:
    how = done.outcome + (f": {done.cause}" if done.cause else "")
    return "\n".join(line for line in (done.skill, done.command, how, done.state) if line)


def level(run: Run) -> Lane:
    """The level of autonomy in force."""
    start = run.scenario.get("autonomy")
    told = [(r.t_s, r.level) for r in run.records if isinstance(r, TransitionTaken)]
    told += [(r.t_s, n) for r in run.records if isinstance(r, Released) and (n := _set_level(r)) is not None]
    told.sort(key=lambda at: at[0])
    first = LEVELS.index(start) if isinstance(start, str) and start in LEVELS else told[0][1] if told else None
    if first is None:
        return Lane("level", "Autonomy", ())
    changes = [(0.0, first)]
    for t_s, n in told:
        if n != changes[-1][1] and 0 <= n < len(LEVELS):
            changes.append((t_s, n))
    share = tuple(0.1 + 0.8 * n / (len(LEVELS) - 1) for _, n in changes)
    words = tuple(f"level {_level(n)}" for _, n in changes)
    step = Step(0, _LEVEL, tuple(t_s for t_s, _ in changes), share, words)
    ticks = tuple((0.1 + 0.8 * n / (len(LEVELS) - 1), name) for n, name in enumerate(LEVELS))
    return Lane("level", "Level of autonomy", (Row("", height=54, ticks=ticks),), steps=(step,))


def _set_level(came: Released) -> int | None:
    word = came.command.removeprefix("level ")
    return int(word) if came.effect == "level" and word.isdecimal() else None


def layers(run: Run) -> Lane:
    """Layers of control, in the paper's rows and colours; nothing where the crew did not work at layers."""
    if not timeline_layers.has_layers(run.records):
        return Lane("layers", "", ())
    darker = {"black": "ink", "purple": "violet", "darkgreen": "forest"}
    colours = {row: darker.get(colour, colour) for row, colour in timeline_layers.COLOURS.items()}
    work = [r for r in run.records if isinstance(r, Layer)]
    bars, made = [], []
    for row, (name, spans) in enumerate(timeline_layers.rows_of(run.records).items()):
        look = Kind("", colours[name])
        bars += [Bar(a, b, row, look, _of_layer(name, a, b, work)) for a, b in spans if b > a]
        tick = Kind("", colours[name], "star" if name == "checkpoint" else "tick")
        made += [Mark(a, row, tick, name) for a, b in spans if b == a]
    rows = tuple(Row(name) for name in timeline_layers.COLOURS)
    return Lane("layers", "Layers of control (ViGIR paper, Fig. 17)", rows, bars=tuple(bars), marks=tuple(made))


def _of_layer(name: str, start_s: float, end_s: float, work: Iterable[Layer]) -> str:
    rows = timeline_layers.ROWS_OF_LAYERS
    did = [w.text for w in work if rows.get(w.layer, w.layer) == name and w.start_s < end_s and w.t_s > start_s]
    return "\n".join([name, *dict.fromkeys(did)])
