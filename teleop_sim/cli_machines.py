"""``teleop-sim machines``: what a state machine is, without running it. Arguments and printing; nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from teleop_sim.cli_errors import errors_shown
from teleop_sim.cli_io import say
from teleop_sim.core.errors import BadInput, Problem, UnknownName

if TYPE_CHECKING:
    from teleop_sim.machines.declare import Machine
    from teleop_sim.machines.net import Configuration

machines_app = typer.Typer(no_args_is_help=True, help="List, show, check and draw state machines.")

LEVELS = ("off", "low", "high", "full")


def _complete_machine(incomplete: str) -> list[str]:
    from teleop_sim.machines.library import MACHINES

    return [name for name in MACHINES if name.startswith(incomplete)]


def _complete_level(incomplete: str) -> list[str]:
    return [name for name in LEVELS if name.startswith(incomplete)]


_Name = Annotated[
    str,
    typer.Argument(
        help="Name of a machine, or path of a .toml file.", autocompletion=_complete_machine, metavar="MACHINE"
    ),
]


@machines_app.command("list")
def list_command() -> None:
    """List the machines that come with teleop-sim, with how many edges have which threshold."""
    with errors_shown():
        from teleop_sim.machines.describe import COLUMNS, sizes
        from teleop_sim.machines.library import MACHINES

        rows = [("name", *COLUMNS)]
        rows += [(name, *map(str, sizes(make()))) for name, make in MACHINES.items()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for name, *numbers in rows:
            cells = (f"{cell:>{width}}" for cell, width in zip(numbers, widths[1:], strict=True))
            say("  ".join((f"{name:{widths[0]}}", *cells)))


@machines_app.command("show")
def show_command(
    machine: _Name,
    as_tuple: Annotated[bool, typer.Option("--tuple", help="As the 8-tuple (Σ, S, s0, δ, D, F, U, A).")] = False,
    as_toml: Annotated[bool, typer.Option("--toml", help="As a file, to change it and give its path instead.")] = False,
) -> None:
    """Print the states of MACHINE with their outcomes, thresholds, targets and failure counters."""
    with errors_shown():
        from teleop_sim.machines.describe import describe, tuple_lines
        from teleop_sim.machines.files import machine_to_toml

        if as_tuple and as_toml:
            raise BadInput((Problem("--tuple", "does not go with --toml", "Give one of them."),))
        found = _machine(machine)
        if as_toml:
            say(machine_to_toml(found).rstrip("\n"))
            return
        for line in tuple_lines(found) if as_tuple else describe(found):
            say(line)


@machines_app.command("check")
def check_command(
    machines: Annotated[
        list[str],
        typer.Argument(
            help="Names of machines, or paths of .toml files.", autocompletion=_complete_machine, metavar="MACHINE..."
        ),
    ],
) -> None:
    """Check MACHINES: list everything that is wrong; exit code 2 if anything is."""
    with errors_shown():
        from teleop_sim.machines.describe import sizes

        problems: list[Problem] = []
        for name in machines:
            try:
                states, containers, edges, *_ = sizes(_machine(name))
            except BadInput as error:
                problems += error.problems
                continue
            say(f"{name}: good ({states} states, {containers} containers, {edges} edges)")
        if problems:
            raise BadInput(tuple(problems))


@machines_app.command("draw")
def draw_command(
    machine: _Name,
    out: Annotated[
        Path | None,
        typer.Option(help="File to write: .dot, .svg, .png or .pdf. Default: DOT on standard output.", metavar="FILE"),
    ] = None,
    active: Annotated[
        list[str] | None, typer.Option(help="Highlight this state; may be repeated.", metavar="PATH")
    ] = None,
    level: Annotated[
        str | None,
        typer.Option(
            help="Dash what waits for a person at off, low, high or full.",
            autocompletion=_complete_level,
            metavar="LEVEL",
        ),
    ] = None,
    without_commands: Annotated[
        bool, typer.Option("--without-commands", help="Leave out what only a person may wish.")
    ] = False,
    all_lines: Annotated[
        bool, typer.Option("--all-lines", help="Draw commands, and all ways to a state to which many lead, as lines.")
    ] = False,
) -> None:
    """Draw MACHINE, its transitions coloured by threshold. Pictures need Graphviz's program dot."""
    with errors_shown():
        from teleop_sim.machines.draw import Look, machine_dot
        from teleop_sim.machines.draw_file import refuse_suffix, write_drawing

        if out is not None:
            refuse_suffix(out)
        found = _machine(machine)
        where = _configuration(found, tuple(active)) if active else None
        look = Look(where, None if level is None else _level(level), not without_commands, not all_lines)
        dot = machine_dot(found, look)
        if out is None:
            say(dot.rstrip("\n"))
            return
        write_drawing(dot, out)
        say(f"wrote {out}")


def _machine(name: str) -> Machine:
    from teleop_sim.machines.files import load_machine
    from teleop_sim.machines.library import MACHINES

    if name in MACHINES:
        return MACHINES[name]()
    if name.endswith(".toml") or Path(name).is_file():
        return load_machine(name)
    raise UnknownName("machine", name, tuple(MACHINES))


def _level(name: str) -> int:
    if name not in LEVELS:
        raise UnknownName("--level", name, LEVELS)
    return LEVELS.index(name)


def _configuration(machine: Machine, paths: tuple[str, ...]) -> Configuration:
    """The states of these paths, and those that a container among them begins with, are active."""
    from teleop_sim.machines.net import Configuration

    net = machine.net
    for path in paths:
        if path not in machine.state_names:
            raise UnknownName("--active", path, machine.state_names)
    numbers = dict.fromkeys(number for path in paths for number in net.nodes[net.by_path[path]].entry)
    return Configuration(tuple(sorted(numbers)))
