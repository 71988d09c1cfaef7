"""``teleop-sim channel``: what a link does to messages, without a robot. Arguments and printing; nothing else."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from teleop_sim.cli_errors import errors_shown
from teleop_sim.cli_io import say
from teleop_sim.core.errors import BadInput, Problem

if TYPE_CHECKING:
    from teleop_sim.channel.message import DirectionName
    from teleop_sim.channel.presets import Preset
    from teleop_sim.channel.settings import DirectionSettings
    from teleop_sim.channel.trace import TraceRow
    from teleop_sim.cli_link import ChosenLink

channel_app = typer.Typer(no_args_is_help=True, help="Try a link alone: list and show presets, trace messages.")


def _complete_preset(incomplete: str) -> list[str]:
    from teleop_sim.channel.presets import PRESETS

    return [name for name in PRESETS if name.startswith(incomplete)]


@channel_app.command("list")
def list_command() -> None:
    """List the links that come with teleop-sim."""
    with errors_shown():
        from teleop_sim.channel.presets import PRESETS

        rows = [("name", "uplink", "downlink", "delay", "source")]
        rows += [(made.name, *_rates_and_delay(made), made.source) for made in PRESETS.values()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for row in rows:
            say("  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _rates_and_delay(made: Preset) -> tuple[str, str, str]:
    from teleop_sim.cli_link import delay_words, rate_words

    up, down = (rate_words(_shown_settings(made, name)) for name in ("up", "down"))
    if "burst" in made.ways:
        down += f" + {rate_words(made.ways['burst'].base)}"
    return up, down, delay_words(_shown_settings(made, "up"))


def _shown_settings(made: Preset, way: str) -> DirectionSettings:
    """Two rounds of an alternating link are enough to see it."""
    import numpy as np

    spells = made.ways[way].alternating
    if not spells:
        return made.ways[way].base
    return made.ways[way].settings(sum(spell.for_s for spell in spells), np.random.default_rng(0))


@channel_app.command("show")
def show_command(
    name: Annotated[str, typer.Argument(help="Of a preset.", autocompletion=_complete_preset, metavar="NAME")],
) -> None:
    """Print everything about the preset NAME, with its sources and what is assumed."""
    with errors_shown():
        from teleop_sim.channel.presets import preset

        made = preset(name)
        say(f"{made.name}: {made.title}")
        say(f"source: {made.source} ({made.status})")
        say(f"clock: {made.clock} time")
        say(f"a fragment being sent when it gets dark: {made.on_dark}; bits that are out: {made.on_dark_flight}")
        for way in made.ways:
            for line in _way_lines(made, way):
                say(line)
        for label, words in (("assumed", ", ".join(made.assumed)), ("note", made.note)):
            if words:
                say(f"{label}: {words}")
        for fact, value in made.facts.items():
            say(f"{fact}: {value}")


def _way_lines(made: Preset, way: str) -> list[str]:
    from dataclasses import asdict, is_dataclass

    from teleop_sim.cli_link import rate_words
    from teleop_sim.core.units import format_rate, format_time

    spec = made.ways[way]
    lines = [f"{way}:"]
    for spell in spec.alternating:
        rate, delay = format_rate(spell.rate_bps), format_time(spell.delay_s)
        lines.append(f"  {format_time(spell.for_s)} in turn: {rate}, {delay} one way")
    if not spec.alternating:
        lines.append(f"  rate: {rate_words(spec.base)}")
        lines.append(f"  delay: {format_time(spec.base.delay_s)} one way")
    dark: object = spec.dark
    if is_dataclass(dark) and not isinstance(dark, type):
        keys = ", ".join(f"{key} {value}" for key, value in asdict(dark).items())
        lines.append(f"  dark: {type(dark).__name__} ({keys})")
    return lines


@channel_app.command("trace")
def trace_command(
    messages: Annotated[
        str,
        typer.Argument(help="CSV: time in s, topic, bytes, priority (if any). -: stdin.", metavar="MESSAGES.csv"),
    ],
    preset: Annotated[
        str | None, typer.Option(help="See channel list.", autocompletion=_complete_preset, metavar="NAME")
    ] = None,
    direction: Annotated[
        str | None, typer.Option(help="up, down, or burst where the preset has it. Default: up.", metavar="WAY")
    ] = None,
    uplink: Annotated[str | None, typer.Option(help="Rate to the robot, such as 380bps.", metavar="RATE")] = None,
    downlink: Annotated[str | None, typer.Option(help="Rate back, such as 380kbps.", metavar="RATE")] = None,
    latency: Annotated[str | None, typer.Option(help="One-way delay, such as 10s.", metavar="TIME")] = None,
    jitter: Annotated[str | None, typer.Option(help="Added delay, uniform up to this.", metavar="TIME")] = None,
    loss: Annotated[str | None, typer.Option(help="Probability that a packet is lost.", metavar="SHARE")] = None,
    blackout: Annotated[
        list[str] | None, typer.Option(help="Such as 10s-40s, or 10s- for ever; may be repeated.", metavar="FROM-TO")
    ] = None,
    on_dark: Annotated[
        str | None, typer.Option(help="What is being sent when it gets dark: pause, restart or lose.", metavar="RULE")
    ] = None,
    queue: Annotated[str | None, typer.Option(help="Packets that may wait; 0: no limit.", metavar="N")] = None,
    discipline: Annotated[str | None, typer.Option(help="fifo, priority or newest.", metavar="NAME")] = None,
    drop: Annotated[str | None, typer.Option(help="Who goes from a full queue: tail or head.", metavar="END")] = None,
    mtu: Annotated[str | None, typer.Option(help="Largest packet in bytes; 0: no limit.", metavar="N")] = None,
    header: Annotated[str | None, typer.Option(help="Header of each packet in bytes.", metavar="N")] = None,
    budget: Annotated[str | None, typer.Option(help="Bits that may be sent in all.", metavar="BITS")] = None,
    real_time_factor: Annotated[
        str | None,
        typer.Option(help="Simulated seconds in a second on the wall, for presets in wall time.", metavar="X"),
    ] = None,
    until: Annotated[str | None, typer.Option(help="When to stop. Default: when all is over.", metavar="TIME")] = None,
    seed: Annotated[str | None, typer.Option(help="Fixes all chance. Default: 0.", metavar="N")] = None,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print CSV; so it is without --plot.")] = False,
    plot: Annotated[
        Path | None, typer.Option(help="Draw when each arrives and why it waited: .svg or .png.", metavar="FILE")
    ] = None,
) -> None:
    """Send MESSAGES over one direction of a link; print when each arrives and why it waited.

    The link is a preset, or made of options; an option beside a preset replaces what the preset says.
    """
    given = {
        "--preset": preset,
        "--direction": direction,
        "--uplink": uplink,
        "--downlink": downlink,
        "--latency": latency,
        "--jitter": jitter,
        "--loss": loss,
        "--on-dark": on_dark,
        "--queue": queue,
        "--discipline": discipline,
        "--drop": drop,
        "--mtu": mtu,
        "--header": header,
        "--budget": budget,
        "--real-time-factor": real_time_factor,
        "--until": until,
        "--seed": seed,
    }
    with errors_shown():
        _refuse_picture(plot)
        rows, chosen = _traced(messages, given, blackout or [])
        if as_csv or plot is None:
            from teleop_sim.channel.trace import trace_csv

            say(trace_csv(rows).rstrip("\n"))
        if plot is not None:
            from teleop_sim.channel.trace_picture import draw_trace

            draw_trace(rows, plot, chosen.title, chosen.settings.blackouts)
            if not as_csv:
                say(f"wrote {plot}")


def _refuse_picture(plot: Path | None) -> None:
    from teleop_sim.channel.trace_picture import SUFFIXES

    if plot is not None and plot.suffix.lower() not in SUFFIXES:
        raise BadInput((Problem("--plot", f"{plot} is no .svg or .png", "Name the file so."),))


def _traced(
    messages: str, given: dict[str, str | None], blackouts: list[str]
) -> tuple[tuple[TraceRow, ...], ChosenLink]:
    """The rows and the link; problems of the file and of the options together."""
    from teleop_sim.channel.trace import Offer, read_offers, trace
    from teleop_sim.cli_link import link_from
    from teleop_sim.core.streams import stream

    problems: list[Problem] = []
    offers: tuple[Offer, ...] = ()
    try:
        offers = read_offers(_text(messages), messages)
    except BadInput as error:
        problems += error.problems
    try:
        chosen = link_from(given, blackouts, max((offer.time_s for offer in offers), default=0.0))
    except BadInput as error:
        raise BadInput((*problems, *error.problems)) from None
    if problems:
        raise BadInput(tuple(problems))
    rng = stream(chosen.seed, 0, f"link.{chosen.way}")
    way: DirectionName = "up" if chosen.way == "up" else "down"
    return trace(offers, chosen.settings, rng, way, chosen.until_s), chosen


def _text(messages: str) -> str:
    data = sys.stdin.buffer.read() if messages == "-" else Path(messages).read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise BadInput((Problem(f"{messages}:{line}", "not UTF-8", "Save it as UTF-8."),)) from None
