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
