"""TCP's retransmission time-out: RFC 6298, section 2 and rules 5.5 and 5.7, as a value."""

from __future__ import annotations

from dataclasses import dataclass, replace

FIRST_S = 1.0
"""Before any round trip was measured (rule 2.1)."""
LEAST_S = 1.0
"""Rule 2.4."""
MOST_S = 60.0
"""Rule 2.5 allows a limit of at least this."""
AFTER_SYN_LOST_S = 3.0
"""Rule 5.7: when data begin after the timer of a SYN has run out."""


@dataclass(frozen=True, slots=True)
class RoundTrips:
    """What a sender knows of its round trips. The clock is taken to be exact (G = 0).

    Attributes:
        rto_s: the time-out now.
        smoothed_s: SRTT; None: nothing was measured.
        spread_s: RTTVAR.

    Source: RFC 6298 (2011), after Jacobson, Congestion Avoidance and Control (1988).

    """

    rto_s: float = FIRST_S
    smoothed_s: float | None = None
    spread_s: float = 0.0

    def measured(self, round_s: float) -> RoundTrips:
        """After a round trip of a segment that was sent once (Karn); rules 2.2 and 2.3."""
        if self.smoothed_s is None:
            smoothed_s, spread_s = round_s, round_s / 2.0
        else:
            spread_s = 0.75 * self.spread_s + 0.25 * abs(self.smoothed_s - round_s)
            smoothed_s = 0.875 * self.smoothed_s + 0.125 * round_s
        return RoundTrips(min(MOST_S, max(LEAST_S, smoothed_s + 4.0 * spread_s)), smoothed_s, spread_s)

    def backed_off(self) -> RoundTrips:
        """After the timer has run out; rule 5.5."""
        return replace(self, rto_s=min(MOST_S, 2.0 * self.rto_s))

    def after_syn_lost(self) -> RoundTrips:
        """When data begin and the timer of the SYN has run out; rule 5.7."""
        return replace(self, rto_s=AFTER_SYN_LOST_S)
