"""Everything that happens in a run, as types. One record is one message in the log.

All times are simulated seconds on the one clock. ``t_s`` is when the record was written; times only grow.
Fields are ``float``, ``int``, ``bool``, ``str`` or ``tuple[float, ...]``; the log derives its schemas from them.
A new kind of record is one class here with ``@record("topic")``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, dataclass_transform

MODES = ("normal", "auto", "manual", "not_recoverable")
"""Modes of the machine, from best to worst."""


@dataclass(frozen=True)
class Record:
    """Base of all records: something that happened at a simulated time."""

    t_s: float


Emit = Callable[[Record], None]
"""Where a part of the simulator puts its records."""

_R = TypeVar("_R", bound=Record)
RECORDS: dict[str, type[Record]] = {}
"""Topic to record type."""
LATE_TOPICS = frozenset({"link/message", "field/disturbance", "field/claim", "operator/judgement", "operator/layer"})
"""Topics that a log declares with their first record only: a log without any has no trace of them."""


@dataclass_transform(frozen_default=True)
def record(topic: str) -> Callable[[type[_R]], type[_R]]:
    """Make a class a frozen record and register it under its topic."""

    def register(cls: type[_R]) -> type[_R]:
        made = dataclass(frozen=True)(cls)
        RECORDS[topic] = made
        return made

    return register


@record("run/started")
class RunStarted(Record):
    """What is run. ``scenario_toml`` is the whole scenario after overrides: enough to repeat the run."""

    scenario: str
    scenario_toml: str
    seed: int
    replicate: int
    time_limit_s: float
    versions: str


@record("run/ended")
class RunEnded(Record):
    """How the run ended. A log without this record was interrupted.

    ``outcome``: ``completed``, ``failed`` or ``censored`` (the time limit came first).
    ``cause``: in words; the physical cause of a failure. ``completion_time_s`` is NaN unless completed.
    """

    outcome: str
    cause: str
    completion_time_s: float
    round_trips: int
    operator_acts: int


@record("link/packet")
class PacketEnded(Record):
    """The fate of one packet, written when it is known.

    ``outcome``: ``delivered``, ``dropped`` (``reason`` says why) or ``in_flight`` (the run ended first).
    ``sent_s`` is when it was offered to the link, ``service_s`` when its first bit went out (NaN: never),
    ``arrived_s`` when its last bit arrived (NaN: never). The five waits add up to ``arrived_s - sent_s``.
    ``text`` says what the packet meant, for readers of the log; it is not sent. ``retransmission_s`` is the time in
    which bits went out in vain and had to be sent again. ``priority``: greater is more urgent.
    """

    direction: str
    packet: int
    topic: str
    payload_bytes: int
    size_bits: int
    sent_s: float
    service_s: float
    arrived_s: float
    queue_s: float
    blackout_s: float
    serialisation_s: float
    propagation_s: float
    outcome: str
    reason: str
    text: str
    retransmission_s: float = 0.0
    priority: int = 0


@record("link/message")
class MessageEnded(Record):
    """The fate of one message whose delivery repeats or acknowledges, written when it is known. Best effort has none.

    Each copy of it is a packet of its own (``link/packet``). ``number``: of the message among those of its direction,
    from 0. ``outcome``: ``delivered`` (the other site's application got it), ``dropped`` (it never will; see
    ``reason``) or ``in_flight`` (the run ended first). ``sent_s`` is when the application handed it over,
    ``delivered_s`` when the other one got it (NaN: never). ``copies``: offered to the link, in all its parts.

    The five waits add up to ``delivered_s - sent_s``; of others to the time until the sender gave up or the run ended.
    ``queue_s``: light time behind others or kept back by its sender; ``blackout_s``: dark; ``serialisation_s``: bits of
    the copy that arrived; ``propagation_s``: that copy in the air, and held by the receiver for order or for other
    parts; ``retransmission_s``: copies in vain. ``text`` says what it meant; it is not sent.
    """

    direction: str
    number: int
    topic: str
    payload_bytes: int
    sent_s: float
    delivered_s: float
    queue_s: float
    blackout_s: float
    serialisation_s: float
    propagation_s: float
    retransmission_s: float
    copies: int
    outcome: str
    reason: str
    text: str


@record("link/blackout")
class Blackout(Record):
    """A direction of the link went dark (``dark`` true) or came back."""

    direction: str
    dark: bool


@record("machine/transition")
class TransitionTaken(Record):
    """The machine at the field site left a state (or took a self-loop).

    ``how``: ``autonomous`` (the guard let it pass), ``confirmed`` (suggested, then confirmed by the operator) or
    ``forced`` (the operator commanded it). ``mode``: mode in which the visit ended, ``normal``, ``auto`` or ``manual``.
    ``retries``: failures in this visit's row of attempts, c in the 8-tuple. ``waited_s``: time suggested before it
    passed.
    """

    state: str
    event: str
    next_state: str
    entered_s: float
    how: str
    mode: str
    retries: int
    threshold: int
    level: int
    waited_s: float
    note: str


@record("machine/mode")
class ModeChanged(Record):
    """The machine's mode changed: ``normal``, ``auto``, ``manual`` or ``not_recoverable``."""

    state: str
    mode: str


@record("machine/request")
class Requested(Record):
    """The field site asked the operator something: ``confirm`` a suggested event, or ``manual`` help."""

    request: int
    kind: str
    state: str
    event: str
    text: str


@record("machine/released")
class Released(Record):
    """What the field site did with a command that arrived. ``request`` 0: it answered none (or a stale one).

    ``effect``: ``answered``, ``forced``, ``level``, ``stopped``, ``ignored``, ... One ``answered`` is one round trip.
    """

    request: int
    command: str
    effect: str
    note: str


@record("field/episode")
class EpisodeEnded(Record):
    """One skill, from start to rest. ``outcome`` and ``cause`` come from physics and sensors alone."""

    start_s: float
    state: str
    skill: str
    command: str
    outcome: str
    cause: str
    physics_s: float


@record("field/wait")
class Waited(Record):
    """The field site waited. ``kind``: ``pacing`` (a fixed wait or poll of the program) or ``operator``."""

    start_s: float
    state: str
    kind: str
    why: str


@record("field/plant")
class PlantSample(Record):
    """Where everything is: pelvis x, y, z [m] and quaternion w, x, y, z; all joints [rad or m] in model order.

    Joint names are in ``PlantNames``. The operator never sees these; they are for reports and replay.
    """

    pelvis: tuple[float, ...]
    joints: tuple[float, ...]


@record("field/plant_names")
class PlantNames(Record):
    """Names for the columns of ``PlantSample.joints``, separated by spaces."""

    joints: str


@record("field/disturbance")
class Disturbed(Record):
    """One figure of what goes otherwise than the robot believes, as drawn for this run; written at its start.

    ``what``: which one, such as ``mass_factor`` or ``plates[0].height_m``; its unit is the name's ending, and its
    meaning is in ``teleop_sim/world/disturbances.py``. ``values``: one number, or the components of a vector. ``text``:
    the value of what is no number. A calm run has none; a controller sees none.
    """

    what: str
    values: tuple[float, ...]
    text: str


@record("field/claim")
class Claimed(Record):
    """Where the robot believed something to be when it showed it to the operator, and where it was: never sent.

    ``what``: ``yaw_wheel``, ``pitch_wheel``, ``yaw_handle`` or ``pitch_handle``. ``picture``: checksum of the picture
    that went with it, as in ``operator/judgement``. ``claimed``, ``true``: its middle, odometry frame [m].
    """

    state: str
    event: str
    picture: int
    what: str
    claimed: tuple[float, ...]
    true: tuple[float, ...]
    error_m: float


@record("task/score")
class Scored(Record):
    """The task's scorer: a checkpoint passed or an axis came in or out of tolerance."""

    checkpoint: int
    text: str


@record("operator/act")
class OperatorActed(Record):
    """The operator did something. ``start_s`` to ``t_s`` it took. ``kind``: ``read``, ``decide``, ``send`` ...

    ``request``: what it answers (0: nothing). ``text``: the command sent, or what was looked at.
    """

    start_s: float
    role: str
    kind: str
    request: int
    text: str


@record("operator/judgement")
class Judged(Record):
    """An operator compared a claim of the robot with the picture that had arrived.

    ``offset_px``: of what the picture shows from where the claim has it, of the worst thing, whose name is ``what``.
    ``sigma_px``: what an eye can tell. ``d_prime_sd`` is their ratio (of a ``body``, whose offset is NaN, how uneven it
    is), and ``evidence_sd`` that and the eye's noise: a claim is rejected where it exceeds ``criterion_sd``.
    ``verdict``: ``accepted``, ``rejected``, or ``unseen`` where the picture that has arrived does not show it (all NaN
    then).
    """

    request: int
    event: str
    picture: int
    what: str
    offset_px: float
    sigma_px: float
    d_prime_sd: float
    evidence_sd: float
    criterion_sd: float
    verdict: str


@record("operator/layer")
class Layer(Record):
    """An operator worked at one of the layers of control from ``start_s`` to ``t_s``; written when it was over.

    ``layer``: ``alignment`` (a template is inserted and laid on the cloud), ``template`` (steps and affordances of it)
    or ``teleoperation`` (a hand or joints moved directly). ``text``: what was done. Work that a behaviour does has
    none; one command from thinking about it until its answer is judged is one record.
    """

    start_s: float
    layer: str
    text: str
