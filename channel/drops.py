"""Why a packet was dropped: every drop has one of these names in its record."""

from __future__ import annotations

QUEUE_FULL = "queue_full"
"""The queue was full when it came, or when a later one came."""
SUPERSEDED = "superseded"
"""A newer packet of its topic took its place in the queue (discipline ``newest``)."""
LOST = "lost"
"""The loss model took at least one of its fragments on the way."""
BLACKOUT = "blackout"
"""It got dark while its bits went out or were in the air, and the settings lose them."""
BUDGET = "budget"
"""What was left of the bit budget was less than the whole packet."""
GAVE_UP = "gave_up"
"""The endpoint had tried as often as it may."""
NO_CONNECTION = "no_connection"
"""The endpoint's patience was over before its connection was open: none of its bytes went out."""

DROP_REASONS = (QUEUE_FULL, SUPERSEDED, LOST, BLACKOUT, BUDGET, GAVE_UP, NO_CONNECTION)
