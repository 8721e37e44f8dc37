"""Events of the hardware journal, chained by hash, and the trials they add up to."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from jaxtyping import Float

from cluster.hardware.states import State


def canonical(value: Mapping[str, Any]) -> str:
    """JSON with one spelling per value, so that equal bodies have equal bytes.

    Raises:
        ValueError: when the value holds NaN or infinity.
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def encode_controller(x: Float[np.ndarray, " D"]) -> str:
    """A controller as little-endian float64 in hexadecimal: exact, whatever reads it."""
    return x.astype("<f8").tobytes().hex()


def digest(x_hex: str) -> str:
    """SHA-256 of an encoded controller's bytes; an approval is bound to it."""
    return hashlib.sha256(bytes.fromhex(x_hex)).hexdigest()


@dataclass(frozen=True)
class Event:
    """One transition of one trial.

    Attributes:
        seq: position in the journal, from 1.
        trial: number of the trial in its campaign, from 0.
        old: state before; None for a proposal.
        new: state after.
        at: UTC time, ISO 8601.
        who: the person or the part of the program that caused it.
        idem: idempotency key.
        body: canonical JSON of what is particular to the transition.
        prev: hash of the event before; of the campaign's identity for the first.
        hash: SHA-256 over all of the above.
    """

    seq: int
    trial: int
    old: State | None
    new: State
    at: str
    who: str
    idem: str
    body: str
    prev: str
    hash: str

    def expected_hash(self) -> str:
        """The hash that the event's other fields have."""
        fields = {key: value for key, value in asdict(self).items() if key != "hash"}
        return hashlib.sha256(canonical(fields).encode()).hexdigest()

    def seal(self) -> "Event":
        """The same event with its hash filled in."""
        return replace(self, hash=self.expected_hash())


@dataclass(frozen=True)
class CampaignTrial:
    """Where one trial stands, and what is known of it.

    Attributes:
        number: in its campaign, from 0.
        robot: that runs it.
        state: the last event's.
        kind: "random", "suggested" or "imported".
        x_hex: controller as little-endian float64 in hexadecimal.
        sha256: of the controller's bytes.
        f: objective, once measured.
        y: badness in [0, 1], once measured.
        version: number of events so far.
    """

    number: int
    robot: str
    state: State
    kind: str
    x_hex: str
    sha256: str
    f: float | None
    y: float | None
    version: int

    @property
    def x(self) -> Float[np.ndarray, " D"]:
        """The controller, float64, bit for bit as proposed."""
        return np.frombuffer(bytes.fromhex(self.x_hex), dtype="<f8").astype(np.float64)

    @property
    def measurement(self) -> tuple[float, float]:
        """Objective f and badness y.

        Raises:
            ValueError: when the trial has not been measured.
        """
        if self.f is None or self.y is None:
            raise ValueError(f"trial {self.number} must be measured to have f and y, it is {self.state}")
        return self.f, self.y


def apply_event(trial: CampaignTrial | None, event: Event) -> CampaignTrial:
    """Add one more event to a trial.

    Args:
        trial: so far; None before its proposal.
        event: its next one.

    Returns:
        The trial after it.
    """
    body = json.loads(event.body)
    if trial is None:
        x_hex = body["x"]
        return CampaignTrial(
            event.trial, body["robot"], event.new, body["kind"], x_hex, digest(x_hex), None, None, version=1
        )
    f, y = (body["f"], body["y"]) if event.new is State.MEASURED else (trial.f, trial.y)
    return replace(trial, state=event.new, f=f, y=y, version=trial.version + 1)


def replay(events: Iterable[Event]) -> dict[int, CampaignTrial]:
    """The trials that a sequence of events adds up to, by number."""
    trials: dict[int, CampaignTrial] = {}
    for event in events:
        trials[event.trial] = apply_event(trials.get(event.trial), event)
    return trials


def broken_link(events: Iterable[Event], genesis: str) -> str | None:
    """Look for the place where the hash chain breaks.

    Args:
        events: in order.
        genesis: the hash that the first event must follow.

    Returns:
        What is wrong there, in words; None when the chain is whole.
    """
    prev = genesis
    for position, event in enumerate(events, start=1):
        if event.seq != position:
            return f"event {position} is missing (found {event.seq} in its place)"
        if event.prev != prev:
            return f"event {event.seq} does not follow the event before it"
        if event.hash != event.expected_hash():
            return f"event {event.seq} (trial {event.trial}, {event.new}) was altered"
        prev = event.hash
    return None


def moment_in_words(at: str) -> str:
    """A moment of UTC, ISO 8601, for people: to the second, without its zone."""
    return at.partition(".")[0].replace("T", " ")


def utc_now() -> datetime:
    """Now, in UTC."""
    return datetime.now(UTC)
