"""Completions that several commands share. What they need is imported when they are asked."""

from __future__ import annotations


def complete_preset(incomplete: str) -> list[str]:
    """Links by name."""
    from teleop_sim.channel.presets import PRESETS

    return [name for name in PRESETS if name.startswith(incomplete)]


def complete_delivery(incomplete: str) -> list[str]:
    """Deliveries by name."""
    from teleop_sim.channel.delivery import DELIVERIES

    return [name for name in DELIVERIES if name.startswith(incomplete)]


def complete_autonomy(incomplete: str) -> list[str]:
    """Levels of autonomy."""
    return _names("AUTONOMY", incomplete)


def complete_layer(incomplete: str) -> list[str]:
    """Who works at the door or valve."""
    return _names("LAYERS", incomplete)


def complete_pacing(incomplete: str) -> list[str]:
    """Pacings by name."""
    return _names("PACINGS", incomplete)


def complete_policy(incomplete: str) -> list[str]:
    """What a crew has agreed on, by name."""
    return _names("POLICIES", incomplete)


def complete_robot(incomplete: str) -> list[str]:
    """Robots by name."""
    return _names("ROBOTS", incomplete)


def _names(table: str, incomplete: str) -> list[str]:
    from teleop_sim.scenarios import names

    return [name for name in getattr(names, table) if name.startswith(incomplete)]


def complete_scenario(incomplete: str) -> list[str]:
    """Names of the scenarios that come along."""
    from teleop_sim.scenarios.library import list_scenarios

    return [name for name in list_scenarios() if name.startswith(incomplete)]
