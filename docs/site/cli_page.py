"""The reference of the command line, made of the commands themselves."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer.main

from teleop_sim.cli_commands import app

NAME = "teleop-sim"
HEAD = """# Command line

Made of the commands themselves when this site is built; `teleop-sim COMMAND --help` prints the same. Quantities want
their unit: `64bps`, `4kbps`, `250ms`, `20s`, `30min`; k is 1000. Exit codes: 0 done, 1 the task failed or ran out of
time, 2 bad input, 130 interrupted. `teleop-sim --install-completion` teaches the shell to complete commands and names.
"""


def commands(group: Any = None, above: str = NAME) -> Iterator[tuple[str, Any]]:
    """Every command with its full name, in the order of ``--help``; groups before what is in them."""
    for name, command in (group or typer.main.get_command(app)).commands.items():
        if command.hidden:
            continue
        yield f"{above} {name}", command
        if hasattr(command, "commands"):
            yield from commands(command, f"{above} {name}")


def markdown() -> str:
    """The page."""
    return "\n\n".join([HEAD, *(_section(name, command) for name, command in commands())]) + "\n"


def _section(name: str, command: Any) -> str:
    level = "##" if name.count(" ") == 1 else "###"
    head = f"{level} `{name}`\n\n{_text(command.help)}"
    if hasattr(command, "commands"):
        return head
    wanted = [p for p in command.params if not getattr(p, "hidden", False) and p.name != "help"]
    named = [p for p in wanted if p.opts[0].startswith("-")]
    usage = " ".join([name, *(_argument(p) for p in wanted if p not in named), *(["[OPTIONS]"] if named else [])])
    parts = [head, f"```text\n{usage}\n```"]
    if wanted:
        rows = [f"| {_names(p)} | {_cell(p.help or '')} | {_default(p)} |" for p in wanted]
        parts.append("\n".join(["| Argument | Meaning | Default |", "|---|---|---|", *rows]))
    return "\n\n".join(parts)


def _argument(parameter: Any) -> str:
    word = parameter.metavar or parameter.name.upper()
    return word if parameter.required else f"[{word}]"


def _names(parameter: Any) -> str:
    if not parameter.opts[0].startswith("-"):
        return f"`{_argument(parameter)}`"
    value = "" if parameter.is_flag else f" {parameter.metavar or 'VALUE'}"
    return ", ".join(f"`{name}{value}`" for name in [*parameter.opts, *parameter.secondary_opts])


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    nothing = parameter.default is None or parameter.default in (False, (), [])
    return "" if nothing or callable(parameter.default) else f"`{parameter.default}`"


def _text(text: str | None) -> str:
    """Help as a paragraph: capitals are placeholders, angle brackets no HTML."""
    return _cell(text or "", pipes=False)


def _cell(text: str, *, pipes: bool = True) -> str:
    # Where options are named within a sentence, two dashes must not become one.
    safe = re.sub(r"(?<![\w`-])(--[a-z][\w-]*)", r"`\1`", text).replace("<", "&lt;").replace("*", "\\*")
    return safe.replace("|", "\\|").replace("\n", " ") if pipes else safe
