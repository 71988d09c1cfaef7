"""The clock question: a link whose limits run in wall time, under a simulation that runs slower than the wall.

The Space Robotics Challenge shaped real sockets (a token bucket and a fixed delay in the network card's queue: limits
per second on the wall) while its worlds ran at a real-time factor of about 0.16, that is 0.16 simulated seconds in a
second on the wall. Seen from the simulated robot such a link is faster and nearer. With factor f:

- a time t on the wall is ``t * f`` in simulation: delays, blackouts, instants at which a rate changes;
- a rate of r bit in a wall second is ``r / f`` bit in a simulated second;
- bits stay bits: headers, budgets, what fits into a window.

So 64 bit/s and 10 s on the wall are 400 bit/s and 1.6 s at 0.16.

Not modelled: a factor that changes within a run; the mean stands for it.

Sources: osrf/cloudsim-sim @a88accc, src_tc.rb (where the limits act); threads of osrf/srcsim (the factor).
"""

from __future__ import annotations

import math

from teleop_sim.channel.blackouts import Schedule
from teleop_sim.channel.rates import RateSchedule
from teleop_sim.core.errors import BadInput, Problem

SRC_REAL_TIME_FACTOR = 0.16
"""What teams of the Space Robotics Challenge reported (threads of osrf/srcsim)."""


def simulated_s(wall_s: float, factor: float) -> float:
    """A time on the wall in simulated seconds.

    Raises:
        BadInput: a factor that is not finite and above zero. So do the others here.

    """
    return wall_s * _checked(factor)


def simulated_bps(wall_bps: float, factor: float) -> float:
    """A rate per second on the wall as bits in a simulated second."""
    return wall_bps / _checked(factor)


def simulated_schedule(wall: Schedule, factor: float) -> Schedule:
    """Blackouts on the wall in simulated seconds."""
    return tuple((simulated_s(a_s, factor), simulated_s(b_s, factor)) for a_s, b_s in wall)


def simulated_rates(wall: RateSchedule, factor: float) -> RateSchedule:
    """Rates that change on the wall, in simulated seconds."""
    return tuple((simulated_s(from_s, factor), simulated_bps(rate_bps, factor)) for from_s, rate_bps in wall)


def _checked(factor: float) -> float:
    if not (math.isfinite(factor) and factor > 0.0):
        what = f"a factor of {factor} is impossible"
        raise BadInput((Problem("real_time_factor", what, f"Give above zero, such as {SRC_REAL_TIME_FACTOR}."),))
    return factor
