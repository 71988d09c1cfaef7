"""Machines in TOML files: read without running anything, every mistake with its line; and written.

::

    name = "fetch"
    start = "look"
    outcomes = ["fetched", "not_found"]
    goals = ["fetched"]
    edges = [
        { state = "look", event = "seen", to = "grasp", threshold = "low" },
        { state = "look", event = "unseen", to = "not_found", threshold = "high", kind = "failed" },
        { state = "grasp", event = "held", to = "fetched", threshold = "off" },
        { state = "grasp", event = "slipped", to = "look", threshold = "low", kind = "retry" },
    ]

    [[states]]
    name = "look"
    program = "detect"

    [[states]]
    name = "grasp"
    program = "grip"

States of a container follow it as ``[[states.states]]``. ``plain`` says what else may be given.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.file_lines import with_lines
from teleop_sim.machines.plain import machine_plain, read_machine
from teleop_sim.machines.plain_table import Table
from teleop_sim.machines.toml_text import toml_text


def load_machine(path: str | Path) -> Machine:
    """The machine that a TOML file declares.

    Raises:
        BadInput: every mistake of the file, or everything that the checks find, with lines where they are known; or it
            cannot be read.

    """
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise BadInput((Problem(f"{path}:{line}", "is not UTF-8", "Save the file as UTF-8."),)) from None
    except OSError as error:
        raise BadInput((Problem(str(path), f"cannot be read: {error.strerror}"),)) from None
    return parse_machine(text, str(path))


def parse_machine(text: str, where: str) -> Machine:
    """As ``load_machine``, from the text; ``where`` is what errors call it."""
    try:
        table = Table(tomllib.loads(text))
        machine = read_machine(table)
    except BadInput as error:
        raise BadInput(with_lines(text, where, error.problems)) from None
    except RecursionError:
        raise BadInput((Problem(where, "is nested too deeply", "Give fewer containers within each other."),)) from None
    except ValueError as error:  # TOMLDecodeError, or a whole number with thousands of digits
        raise BadInput((_no_toml(str(error), where),)) from None
    if machine is None:
        raise BadInput(with_lines(text, where, table.problems))
    return machine


def machine_to_toml(machine: Machine) -> str:
    """The machine as TOML text; ``parse_machine`` gives an equal one back."""
    return toml_text(machine_plain(machine))


def _no_toml(why: str, where: str) -> Problem:
    found = re.search(r" \(at line (\d+), column (\d+)\)\Z", why)
    place = f"{where}:{found[1]}:{found[2]}" if found else where
    what = why[: found.start()] if found else why
    hint = 'A line is a [table], key = value or # comment; text stands in "quotes".'
    return Problem(place, f"is not TOML: {what[:1].lower()}{what[1:]}", hint)
