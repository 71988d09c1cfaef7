"""What TCP repeats before its timer runs out: RFC 5681, section 3.2, and RFC 6582, section 3.2 (NewReno), as a value.

The windows of those standards (``cwnd``, ``ssthresh``) are left out: nothing here says how much may be on its way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

DUPLICATES = 3
"""Acknowledgements of the same number, beside the first, that are taken for a loss (RFC 5681, section 3.2)."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """What a sender makes of its acknowledgements. Numbers are of bytes, counted without wrapping.

    Attributes:
        duplicates: acknowledgements since the last that said something new, which it was like.
        until: the next number to be sent when something was last taken for lost; RFC 6582's ``recover`` is one less.
        under_way: not all before ``until`` is acknowledged.

    After a time-out, too, each acknowledgement that leaves a part of what was on its way repeats the oldest. By RFC
    5681 a sender takes all of that for lost and repeats it by slow start; one segment an acknowledgement, without
    slow start's growth, is assumed.

    Not modelled: selective acknowledgements (RFC 6675), a limit for few segments on their way (RFC 5827), telling a
    time-out that was too early from a loss (RFC 5682), the heuristics of RFC 6582, section 4.

    """

    duplicates: int = 0
    until: int = 0
    under_way: bool = False

    def duplicate(self, oldest: int, following: int) -> tuple[Recovery, bool]:
        """The same number once more, while data are on their way; and whether the oldest segment is to be repeated.

        Args:
            oldest: number that is acknowledged.
            following: the next to be sent.

        """
        counted = replace(self, duplicates=self.duplicates + 1)
        # Copies of what had arrived are answered by duplicates too: of those nothing is concluded, nor while a recovery
        # is under way.
        if counted.duplicates != DUPLICATES or oldest <= self.until:
            return counted, False
        return Recovery(counted.duplicates, following, under_way=True), True

    def advanced(self, oldest: int) -> tuple[Recovery, bool]:
        """All before ``oldest`` is acknowledged now; and whether the segment that begins there is to be repeated."""
        partial = self.under_way and oldest < self.until
        return Recovery(0, self.until, partial), partial

    def timed_out(self, following: int) -> Recovery:
        """The timer has run out, and the oldest segment was repeated."""
        return Recovery(0, following, under_way=True)
