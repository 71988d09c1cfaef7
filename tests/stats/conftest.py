"""Synthetic experiments whose truth is known."""

from collections.abc import Callable, Iterable

import pytest

EXPERIMENTS = 1000


def _in_bounds(covered: Iterable[bool]) -> None:
    hits = list(covered)
    assert len(hits) == EXPERIMENTS
    # What the project promises of every 95 % interval. Of 1,000 true 95 % intervals, 930 to 970 cover with
    # probability 0.997 (2.9 standard deviations); the seeds below are fixed.
    assert 930 <= sum(hits) <= 970, f"{sum(hits)} of {EXPERIMENTS} intervals cover"


@pytest.fixture
def covers() -> Callable[[Iterable[bool]], None]:
    return _in_bounds
