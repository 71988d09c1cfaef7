"""ViGIR's behaviours as published: containers, keys, parameters, embedded behaviours and thresholds.

Facts: ``vigir_<behaviour>.csv`` (one row an outcome), ``vigir_containers.csv`` and ``vigir_start.csv``, taken from
team-vigir/vigir_behaviors @6696e7b, behaviors/*/src/*/*_sm.py; which keys a state reads and which it writes from
vigir_flexbe_states and FlexBE/flexbe_behavior_engine @b1422c2. States, events, keys and thresholds are as there.

A state's program is named after its class. What the originals compute (controllers by hand side, small functions) is a
parameter in angle brackets. Keys that a behaviour both starts with and reads come from outside when it is embedded.

What kind an outcome is, is our rule, as FlexBE has none: ``KINDS`` by its name, ``command`` for what a person decides,
else ``done``.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

from teleop_sim.machines.declare import Machine, embed
from teleop_sim.machines.elements import (
    INHERIT,
    Autonomy,
    Edge,
    Element,
    Given,
    Group,
    Kind,
    Pairs,
    Parameter,
    State,
    Value,
)
from teleop_sim.machines.mending import Mending, mended
from teleop_sim.machines.net import join
from teleop_sim.machines.wpi import Table, read_table

THRESHOLDS: Mapping[str, int] = MappingProxyType(
    {"Off": Autonomy.OFF, "Low": Autonomy.LOW, "High": Autonomy.HIGH, "Full": Autonomy.FULL, "Inherit": INHERIT}
)

KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        **dict.fromkeys(("failed", "aborted", "no_connection", "data_error", "not_available", "incorrect"), "failed"),
        **dict.fromkeys(("incomplete", "again", "next", "adjust", "pregrasp_again"), "retry"),
    }
)
"""Kinds by name: ``failed`` where nothing came of it, ``retry`` where part of it or another try is asked for."""

EMBEDDED = MappingProxyType(
    {
        "Behavior:WalktoTemplateSM": "walk_to_template",
        "Behavior:GraspObjectSM": "grasp_object",
        "Behavior:PickupObjectSM": "pickup_object",
    }
)
"""Classes that stand for another behaviour."""

CONTAINER, DECISION = "OperatableStateMachine", "OperatorDecisionState"

MENDINGS: Mapping[str, tuple[Mending, ...]] = MappingProxyType(
    {
        "turn_valve_atlas": (
            Mending(
                "Manipulate_Valve",
                "nothing leads there but itself: Prepare_Manipulation goes on to Turn_Valve;"
                " and inside, a decision suggests template_ready, but its outcome is spelt tempalte_ready",
                (
                    "Manipulate_Valve: unreachable from the start",
                    "Manipulate_Valve/Decide_Ready_or_Retry: suggests: unknown name 'template_ready'",
                ),
                spare=True,
                unsuggest="Decide_Ready_or_Retry",
            ),
            Mending(
                "Retract_Arms/Open_Fingers",
                "nothing leads there",
                ("Retract_Arms/Open_Fingers: unreachable from the start",),
                spare=True,
            ),
            Mending(
                "Retract_Arms/Close_Fingers",
                "nothing leads there but Open_Fingers and itself, where it would close the fingers for ever",
                ("Retract_Arms/Close_Fingers: unreachable from the start",),
                spare=True,
            ),
        ),
        "cut_hole_in_wall_atlas": (
            Mending(
                "Optionally_Walk_to_Wall",
                "nothing leads there, and the key with the wall's template is not written before",
                (
                    "Optionally_Walk_to_Wall: unreachable from the start",
                    "Optionally_Walk_to_Wall: key wall_template_id: 'wall_template_id' is read before",
                ),
                spare=True,
            ),
        ),
    }
)
"""What the originals lack, by behaviour. Everything else passes the checks as published."""

ENDLESS_AT_FULL = MappingProxyType(
    {
        "turn_valve_thor": ("Manipulate_Valve/Decide_Repeat", "insert_again"),
        "cut_hole_in_wall_atlas": ("Cut_Circle_in_Wall/Cut_Circle_in_Wall/Decide_Done_Cutting", "cut_more"),
    }
)
"""Decisions that at level full repeat their suggestion until a person lowers the level or forces another outcome.

That is as published: the suggestion's threshold is below full, and what is suggested is to go on.
"""


@cache
def read_behaviour(behaviour: str, mend: bool = True) -> Machine:
    """A behaviour, such as ``open_door_atlas``: the middle of its table's name.

    Args:
        behaviour: which.
        mend: with its ``MENDINGS``; those it embeds are always mended.

    Raises:
        BadInput: with every problem of the declaration.

    """
    start = [r for r in read_table("vigir_start.csv") if r["behaviour"] == behaviour]
    parameters = tuple(Parameter(r["name"], json.loads(r["value"])) for r in start if r["what"] == "parameter")
    names = tuple(p.name for p in parameters)
    top = _container(behaviour, _rows(behaviour), names, "")
    if mend:
        top = mended(top, MENDINGS.get(behaviour, ()))
    return Machine(
        f"vigir_{behaviour}",
        top.start,
        top.states,
        top.edges,
        outcomes=top.outcomes,
        goals=frozenset({"finished"}),
        parameters=parameters,
        data=tuple((r["name"], _value(json.loads(r["value"]), names)) for r in start if r["what"] == "data"),
        reads=_names(_declared(behaviour, "")["reads"]),
        writes=_names(_declared(behaviour, "")["writes"]),
        spare=top.spare,
    )


def threshold_counts(behaviour: str) -> tuple[int, int, int, int, int]:
    """Outcomes with threshold off, low, high, full and inherit: of the behaviour's own rows, not of those it embeds.

    Counted as published, before mending.
    """
    found = Counter(r["threshold"] for r in _rows(behaviour))
    off, low, high, full, inherit = (found[name] for name in THRESHOLDS)
    return off, low, high, full, inherit


def _rows(behaviour: str) -> Table:
    return read_table(f"vigir_{behaviour}.csv")


def _declared(behaviour: str, path: str) -> dict[str, str]:
    rows = read_table("vigir_containers.csv")
    return next(r for r in rows if (r["behaviour"], r["container"]) == (behaviour, path))


def _container(behaviour: str, rows: Table, parameters: tuple[str, ...], path: str) -> Group:
    own: dict[str, dict[str, str]] = {}
    for r in rows:
        if r["container"] == path:
            own.setdefault(r["state"], r)
    around = next((r for r in rows if join(r["container"], r["state"]) == path), {"reads": "", "writes": ""})
    return Group(
        name=path.rpartition("/")[2],
        start=next(name for name, r in own.items() if r["first"] == "1"),
        states=tuple(_element(behaviour, rows, parameters, path, r) for r in own.values()),
        edges=tuple(_edge(r) for r in rows if r["container"] == path),
        outcomes=_names(_declared(behaviour, path)["outcomes"]),
        reads=_pairs(around["reads"]),
        writes=_pairs(around["writes"]),
    )


def _element(behaviour: str, rows: Table, parameters: tuple[str, ...], path: str, r: dict[str, str]) -> Element:
    name, kind = r["state"], r["class"]
    if kind == CONTAINER:
        return _container(behaviour, rows, parameters, join(path, name))
    if kind in EMBEDDED:
        return embed(name, read_behaviour(EMBEDDED[kind]), _pairs(r["reads"]), _pairs(r["writes"]))
    return _state(name, kind, parameters, r)


def _state(name: str, kind: str, parameters: tuple[str, ...], r: dict[str, str]) -> State:
    told = {key: text for key, _, text in (part.partition("=") for part in r["parameters"].split(";")) if key}
    outcomes, suggests = tuple(json.loads(told.pop("outcomes", "[]"))), told.pop("suggestion", "null")
    decides = kind == DECISION
    return State(
        name,
        "" if decides else kind,
        decides=decides,
        suggests="" if suggests == "null" else suggests,
        parameters=tuple((key, _value(_parsed(text), parameters)) for key, text in told.items()),
        outcomes=outcomes,
        reads=_pairs(r["reads"]),
        writes=_pairs(r["writes"]),
    )


def _edge(r: dict[str, str]) -> Edge:
    decided = r["class"] == DECISION
    kind: Kind = "command" if decided else KINDS.get(r["outcome"], "done")
    by_person = decided and f"suggestion={r['outcome']}" not in r["parameters"].split(";")
    threshold = int(THRESHOLDS[r["threshold"]])
    return Edge(r["state"], r["outcome"], r["target"], threshold, kind, "operator" if by_person else "code")


def _parsed(text: str) -> Value:
    """A number, true or false where it reads as one; else the text: lists and tables stay text."""
    try:
        found = json.loads(text)
    except json.JSONDecodeError:
        return text
    return found if isinstance(found, (bool, int, float)) else text


def _value(value: Value, parameters: tuple[str, ...]) -> Value | Given:
    if isinstance(value, str) and value.startswith("<behaviour parameter "):
        name = value.removeprefix("<behaviour parameter ").removesuffix(">")
        return Given(name) if name in parameters else f"<function {name}>"
    return value


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for name in text.split(";") if name)


def _pairs(text: str) -> Pairs:
    return tuple((own, key) for own, _, key in (pair.partition("=") for pair in _names(text)))
