"""What meets what: the tables of docs/machine.md, cell by cell. The tests read the tables; they cannot differ."""

from __future__ import annotations

from pathlib import Path

import pytest
from scripted_site import REST_S, Asks, Site

from teleop_sim.core.records import ModeChanged, Released, Requested, TransitionTaken
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import PARKED, Concurrence, Edge, Group, State
from teleop_sim.machines.modify import Patch, SetThreshold

NOW_S, LATER_S = 5.0, 8.0
"""When something arrives, and when is looked what came of it."""

PAGE = Path(__file__).parents[2] / "docs" / "machine.md"


def table_of(heading):
    """Rows of the first table under a heading of the page, as lists of cells."""
    below = PAGE.read_text(encoding="utf-8").split(f"\n{heading}\n")[1]
    lines = next(block for block in below.split("\n\n") if block.lstrip().startswith("|")).strip().splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [row for row in rows if not set(row[0]) <= set("-: ")]


# The machine, and what its state ``work`` is in when something arrives


def machine_of(**declared):
    state = State("work", **(declared or {"program": "work"}))
    edges = (Edge("work", "done", "next", 2), Edge("work", "failed", "next", 2, "failed"), Edge("next", "ok", "end", 0))
    return Machine("bench", "work", (state, State("next", "next"), State("end")), edges, frozenset({"end"}))


def beside_urgency():
    """The state in a concurrence, in the other region of which something urgent begins after 2 s."""
    urgent = Group("Urgent", "act", (State("act", "act"),), (Edge("act", "ok", "ok", 0),), ("ok",), priority=True)
    edges = (Edge("calm", "ok", "Urgent", 0), Edge("Urgent", "ok", "ok", 0))
    region = Group("Region", "calm", (State("calm", "calm"), urgent), edges, ("ok",))
    parked = (
        Edge("work", "done", PARKED, 2),
        Edge("work", "failed", PARKED, 2, "failed"),
        Edge("Region", "ok", PARKED, 0),
    )
    both = Concurrence("Both", (State("work", "work"), region), parked, ("ok",), "all", default="ok")
    tail = (Edge("Both", "ok", "next", 0), Edge("next", "ok", "end", 0))
    return Machine("bench", "Both", (both, State("next", "next"), State("end")), tail, frozenset({"end"}))


LONG = {"work": [(100.0, "done")], "next": [(100.0, "ok")]}
SHORT = LONG | {"work": [(1.0, "done")]}
URGENT = {"Both/Region/calm": [(2.0, "ok")], "Both/Region/Urgent/act": [(100.0, "ok")]}


def site_with(machine, script, level, **planned):
    site = Site(machine, script, level)
    for name, (when_s, *arguments) in planned.items():
        site.at(when_s, lambda name=name, arguments=arguments: getattr(site.executive, name)(*arguments))
    return site


def suspended(script, level):
    script = {f"Both/{k}" if k == "work" else k: v for k, v in script.items()}
    return site_with(beside_urgency(), script | URGENT, level)


SITUATIONS = {
    "works": (lambda: site_with(machine_of(), LONG, 3),),
    "suggested": (lambda: site_with(machine_of(), SHORT, 0),),
    "waits: manual / decision": (
        lambda: site_with(machine_of(manual=True), LONG, 0),
        lambda: site_with(machine_of(decides=True), LONG, 0),
    ),
    "asks for data": (lambda: site_with(machine_of(), LONG | {"work": [Asks("where", 50.0, "done")]}, 3),),
    "paused: program / suggestion": (
        lambda: site_with(machine_of(), LONG, 3, pause=(2.0,)),
        lambda: site_with(machine_of(), SHORT, 0, pause=(2.0,)),
    ),
    "locked: held / suggestion": (
        lambda: site_with(machine_of(), SHORT, 3, lock=(0.5, "work")),
        lambda: site_with(machine_of(), SHORT, 0, lock=(2.0, "work")),
    ),
    "suspended: program / suggestion": (lambda: suspended(LONG, 3), lambda: suspended(SHORT, 1)),
    "by hand": (lambda: site_with(machine_of(), LONG, 3, take_over=(2.0, "work")),),
    "decided": (lambda: site_with(machine_of(), LONG, 3, force=(4.9, "failed")),),
    "ended": (lambda: site_with(machine_of(), LONG, 3, preempt=(1.0,)),),
}

ARRIVALS = (
    "confirm", "reject, hand back", "answer", "force", "force, not declared", "take over", "level up", "level down",
    "lock", "unlock", "pause", "resume", "preempt", "attach", "modify", "a fall",
)  # fmt: skip


def command(executive, name, path, request):
    match name:
        case "confirm":
            executive.confirm(request)
        case "reject, hand back" | "reject" | "hand back":
            executive.reject(request)
        case "answer":
            executive.answer(request, "there")
        case "force" | "force, not declared":
            executive.force("done" if name == "force" else "sing", path)
        case "level up" | "level down":
            executive.set_level(3 if name == "level up" else 0)
        case "take over" | "lock" | "unlock":
            getattr(executive, name.replace(" ", "_"))(path)
        case "pause" | "resume" | "preempt":
            getattr(executive, name)()
        case "attach":
            executive.attach(executive.machine.checksum)
        case "modify":
            executive.modify(Patch(executive.machine.checksum, (SetThreshold("next", "ok", 1),)))
        case "a fall":
            executive.fell("toppled")


def arrive(site, *names):
    """Let things arrive at one instant; the effects of those that are commands."""
    executive, effects = site.executive, []
    path = "Both/work" if executive.machine.start == "Both" else "work"
    request = next((p.request for p in executive.pendings if p.path == path), 1)
    for name in names:
        before = len(site.of(Released))
        command(executive, name, path, request)
        found = site.of(Released)[before:]
        assert len(found) == (name != "a fall"), "every command leaves one record"
        effects += [r.effect for r in found] or ["fell"]
    return path, effects


def what_came(site, *names):
    """What came of it, in the words of the page, and the effects."""
    found = []
    site.at(NOW_S, lambda: found.append(site.executive.snapshot()), lambda: found.append(arrive(site, *names)))
    site.run(until_s=LATER_S)
    if site.process.processed and not found:
        before, ended_s = site.executive.snapshot(), site.env.now
        _, effects = arrive(site, *names)
        assert site.executive.snapshot().configuration == before.configuration
        assert site.env.now == ended_s
        return word_of_effect(effects[-1]), effects
    before, (path, effects) = found
    return word(site, path, before, effects), effects


def word(site, path, before, effects):
    taken = [r for r in site.of(TransitionTaken) if r.t_s >= NOW_S and r.state == path]
    # The outcome that the situation ``decided`` has chosen already is no news.
    own = [r for r in taken if not (r.event == "failed" and r.t_s == pytest.approx(4.9 + REST_S))]
    hands = [r.t_s for r in site.of(Requested) if r.t_s >= NOW_S and r.kind == "act"]
    if site.process.processed:
        return "ends" if site.env.now == NOW_S else "ends at rest"
    if own and own[0].t_s <= NOW_S + REST_S:
        return "taken" if own[0].t_s == NOW_S else "taken at rest"
    if hands:
        return "by hand" if hands[0] == NOW_S else "by hand at rest"
    if {(NOW_S, path), (NOW_S + REST_S, path)} & set(site.started):
        return "anew"
    if set(effects) == {"ignored"}:
        assert taken or site.executive.snapshot() == before, "ignored is ignored"
        return "ignored"
    if "paused" in effects and not taken and held(site, path):
        return "held"
    if (NOW_S, path) in site.stopped:
        return "stopped"
    return word_of_effect(next(e for e in reversed(effects) if e != "ignored"))


def held(site, path):
    """Is what a person decided taken when the pause is over?"""
    site.at(LATER_S, site.executive.resume)
    site.go_on(LATER_S)
    last = [r for r in site.of(TransitionTaken) if r.t_s == LATER_S and r.state == path and r.how != "autonomous"]
    return bool(last)


def word_of_effect(effect):
    return {"ignored": "ignored", "attached": "told", "modified": "changed", "answered": "given"}.get(effect, "noted")


HEADING = "### Something arrives"
ROWS = table_of(HEADING)
CELLS = [
    (row[0], situation, k, cell.split(" / ")[k if " / " in cell else 0])
    for row in ROWS[1:]
    for situation, cell in zip(ROWS[0][1:], row[1:], strict=True)
    for k in range(len(SITUATIONS[situation]))
]


def test_the_table_has_every_arrival_and_every_situation():
    assert ROWS[0][1:] == list(SITUATIONS)
    assert [row[0] for row in ROWS[1:]] == [*ARRIVALS, "the program's outcome"]


@pytest.mark.parametrize(("arrival", "situation", "variant", "cell"), [c for c in CELLS if c[0] in ARRIVALS])
def test_what_meets_what(arrival, situation, variant, cell):
    site = SITUATIONS[situation][variant]()
    if cell == "-":
        assert (arrival, situation) == ("a fall", "ended")
        return
    came, _ = what_came(site, arrival)
    assert came == cell
    if arrival == "a fall":
        assert site.of(ModeChanged)[-1].mode == "not_recoverable"


@pytest.mark.parametrize(("situation", "variant", "cell"), [c[1:] for c in CELLS if c[0] not in ARRIVALS])
def test_an_outcome_of_the_program_meets(situation, variant, cell):
    site = SITUATIONS[situation][variant]()
    if cell == "-":
        site.run(until_s=NOW_S)
        # No program of the state that could come to an outcome.
        assert not any(site.alive[path] for path in ("work", "Both/work"))
        return
    if situation == "works":
        site.script["work"] = [(NOW_S, "done")]
    if situation == "asks for data":
        site.script["work"] = [Asks("where", 0.0, "done", patience_s=NOW_S)]
    site.run(until_s=LATER_S)
    [taken] = site.of(TransitionTaken)
    if cell == "taken":
        assert (taken.t_s, taken.event, taken.how) == (NOW_S, "done", "autonomous")
        assert site.executive.pendings == ()
    else:
        # The program's last word came while it was brought to rest.
        assert (cell, taken.event, taken.how) == ("dropped", "failed", "forced")


PAIRS = table_of("### Two at one instant")[1:]


@pytest.mark.parametrize(
    ("situation", "names", "cell"),
    [
        (row[0], names, cell)
        for row in PAIRS
        for names, cell in zip(((row[1], row[2]), (row[2], row[1])), row[3:], strict=True)
    ],
)
def test_two_at_one_instant(situation, names, cell):
    site = SITUATIONS[situation][0]()
    came, effects = what_came(site, *names)
    word, _, ignored = cell.partition("; ignored: ")
    assert came == word
    assert [name for name, effect in zip(names, effects, strict=True) if effect == "ignored"] == (
        [ignored] if ignored else []
    )
