"""``teleop-sim channel``: what a link does to messages, without a robot. Arguments and printing; nothing else."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from teleop_sim.cli_complete import complete_delivery, complete_preset
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


def _text_option(words: str, metavar: str, complete: Callable[[str], list[str]] | None = None) -> Any:
    return typer.Option(help=words, metavar=metavar, autocompletion=complete)


_Messages = Annotated[
    str, typer.Argument(help="CSV: time in s, topic, bytes, priority (if any). -: stdin.", metavar="MESSAGES.csv")
]
_Text = str | None
_Preset = Annotated[_Text, _text_option("See channel list.", "NAME", complete_preset)]
_Direction = Annotated[_Text, _text_option("up, down, or burst where the preset has it. Default: up.", "WAY")]
_Delivery = Annotated[
    _Text, _text_option("best_effort, stop_and_wait, selective_repeat, custody or tcp.", "NAME", complete_delivery)
]
_Uplink = Annotated[_Text, _text_option("Rate to the robot, such as 380bps.", "RATE")]
_Downlink = Annotated[_Text, _text_option("Rate back, such as 380kbps.", "RATE")]
_Latency = Annotated[_Text, _text_option("One-way delay, such as 10s.", "TIME")]
_Jitter = Annotated[_Text, _text_option("Added delay, uniform up to this.", "TIME")]
_Loss = Annotated[_Text, _text_option("Probability that a packet is lost.", "SHARE")]
_Blackouts = Annotated[list[str] | None, _text_option("Such as 10s-40s, or 10s- for ever; may be repeated.", "FROM-TO")]
_OnDark = Annotated[_Text, _text_option("What is being sent when it gets dark: pause, restart or lose.", "RULE")]
_Queue = Annotated[_Text, _text_option("Packets that may wait; 0: no limit.", "N")]
_Discipline = Annotated[_Text, _text_option("fifo, priority or newest.", "NAME")]
_Drop = Annotated[_Text, _text_option("Who goes from a full queue: tail or head.", "END")]
_Mtu = Annotated[_Text, _text_option("Largest packet in bytes; 0: no limit.", "N")]
_Header = Annotated[_Text, _text_option("Header of each packet in bytes.", "N")]
_Budget = Annotated[_Text, _text_option("Bits that may be sent in all.", "BITS")]
_RealTimeFactor = Annotated[
    _Text, _text_option("Simulated seconds in a second on the wall, for presets in wall time.", "X")
]
_Until = Annotated[_Text, _text_option("When to stop. Default: when all is over, at most a day later.", "TIME")]
_Seed = Annotated[_Text, _text_option("Fixes all chance. Default: 0.", "N")]
_AsCsv = Annotated[bool, typer.Option("--csv", help="Print CSV; so it is without --plot.")]
_Plot = Annotated[Path | None, _text_option("Draw when each arrives and why it waited: .svg or .png.", "FILE")]


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
    name: Annotated[str, typer.Argument(help="Of a preset.", autocompletion=complete_preset, metavar="NAME")],
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
    messages: _Messages,
    preset: _Preset = None,
    direction: _Direction = None,
    delivery: _Delivery = None,
    uplink: _Uplink = None,
    downlink: _Downlink = None,
    latency: _Latency = None,
    jitter: _Jitter = None,
    loss: _Loss = None,
    blackout: _Blackouts = None,
    on_dark: _OnDark = None,
    queue: _Queue = None,
    discipline: _Discipline = None,
    drop: _Drop = None,
    mtu: _Mtu = None,
    header: _Header = None,
    budget: _Budget = None,
    real_time_factor: _RealTimeFactor = None,
    until: _Until = None,
    seed: _Seed = None,
    as_csv: _AsCsv = False,
    plot: _Plot = None,
) -> None:
    """Send MESSAGES over one direction of a link; print when each arrives and why it waited.

    The link is a preset, or made of options; an option beside a preset replaces what the preset says. A delivery that
    acknowledges uses both directions: options other than the rates hold for both.
    """
    options = {f"--{name.replace('_', '-')}": value for name, value in locals().items()}
    given = {name: value for name, value in options.items() if isinstance(value, str)}
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


def _traced(messages: str, given: dict[str, str], blackouts: list[str]) -> tuple[tuple[TraceRow, ...], ChosenLink]:
    """The rows and the link; problems of the file and of the options together."""
    from teleop_sim.channel.trace import Offer, read_offers, trace
    from teleop_sim.channel.trace_delivered import trace_delivered
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
    way: DirectionName = "up" if chosen.way == "up" else "down"
    rng = stream(chosen.seed, 0, f"link.{chosen.way}")
    if chosen.back is None:
        return trace(offers, chosen.settings, rng, way, chosen.until_s), chosen
    both = (chosen.settings, rng), (chosen.back, stream(chosen.seed, 0, f"link.{chosen.way_back}"))
    return trace_delivered(offers, chosen.delivery, both, way, chosen.until_s), chosen


def _text(messages: str) -> str:
    data = sys.stdin.buffer.read() if messages == "-" else Path(messages).read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise BadInput((Problem(f"{messages}:{line}", "not UTF-8", "Save it as UTF-8."),)) from None
