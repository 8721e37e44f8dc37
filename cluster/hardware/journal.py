"""The durable journal of a hardware campaign: every transition is on disk before it is acted upon."""

import sqlite3
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import astuple, fields
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from cluster.hardware.database import SCHEMA, JournalError, connect, corrupt, reading, sqlite_errors, writing
from cluster.hardware.events import (
    CampaignTrial,
    Event,
    apply_event,
    broken_link,
    canonical,
    digest,
    encode_controller,
    replay,
)
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.states import Approval, State, legal

FILE = "journal.sqlite"
EVENT_COLUMNS = ", ".join(field.name for field in fields(Event))
TRIAL_COLUMNS = ", ".join(field.name for field in fields(CampaignTrial))
INSERT_EVENT = f"INSERT INTO event ({EVENT_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
UPSERT_TRIAL = f"""INSERT INTO trial ({TRIAL_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)
    ON CONFLICT (number) DO UPDATE
    SET state = excluded.state, f = excluded.f, y = excluded.y, version = excluded.version"""

Clock = Callable[[], datetime]


class IllegalTransition(JournalError):  # noqa: N818 - names the transition
    """A trial cannot go from its state to the one asked for."""


class RobotTaken(JournalError):  # noqa: N818 - names the state of the robot
    """Another trial may be moving the robot."""


class KeyReused(JournalError):  # noqa: N818 - names what was done to the key
    """An idempotency key came back with other content."""


class Journal:
    """One campaign's journal in one SQLite file on a local disk; several processes may hold it at once.

    Args:
        path: of the file, which `create` wrote.
        clock: the present time, in UTC.

    Attributes:
        name: of the campaign, unlike any other's.
        identity: what the campaign is.

    Raises:
        JournalCorrupt: when the file, its hash chain or its table of trials is not intact.
        JournalError: when there is no journal, or it cannot be read.
    """

    def __init__(self, path: Path, clock: Clock) -> None:
        if not path.is_file():
            raise JournalError(
                f"no campaign in {path.parent}: it has no {path.name}; name a campaign's folder"
            )
        self.path = path
        self._clock = clock
        with sqlite_errors(path):
            self._connection = connect(path)
            self.name, self.identity = self._campaign()
        self.verify()

    def close(self) -> None:
        """Gives the file back."""
        self._connection.close()

    def propose(
        self, number: int, x: Float[np.ndarray, " D"], kind: str, who: str, facts: Mapping[str, Any]
    ) -> Event:
        """Stores a controller before anything is done with it; once stored it is never computed again.

        Args:
            number: of the trial, from 0.
            x: the controller.
            kind: "random", "suggested" or "imported".
            who: proposes it.
            facts: what the proposal was computed from.

        Returns:
            The event; for equal content, the one that is already there.

        Raises:
            KeyReused: when the trial exists with other content.
        """
        x_hex = encode_controller(x)
        body = {"robot": self.identity.robot, "kind": kind, "x": x_hex, "sha256": digest(x_hex), **facts}
        return self.record(number, State.PROPOSED, who, body, f"{number}/0/{State.PROPOSED}")

    def record(self, number: int, new: State, who: str, body: Mapping[str, Any], idem: str) -> Event:
        """Moves a trial to another state, durably, or not at all.

        Args:
            number: of the trial.
            new: the state it enters.
            who: causes it.
            body: what is particular to the transition; `f` and `y` for a measurement.
            idem: key of this request; with equal content it answers with the event that is already there.

        Returns:
            The event, new or already there.

        Raises:
            IllegalTransition: when the trial's state does not allow it.
            RobotTaken: when another trial of the robot is granted, running or unknown.
            KeyReused: when the key belongs to another request.
        """
        with sqlite_errors(self.path), writing(self._connection):
            known = self._events("WHERE idem = ?", idem)
            if known:
                return _repeat(known[0], number, new, who, canonical(body))
            trial = self._trial(number)
            old = trial.state if trial else None
            allowed = legal(old, trial.kind if trial else "")
            if new not in allowed:
                raise IllegalTransition(_forbidden(number, old, new, allowed))
            seq, prev = self._head()
            at = self._clock().isoformat()
            event = Event(seq + 1, number, old, new, at, who, idem, canonical(body), prev, "").seal()
            self._write(event, apply_event(trial, event))
            return event

    def trial(self, number: int) -> CampaignTrial:
        """One trial.

        Raises:
            JournalError: when the campaign has no trial of that number.
        """
        with sqlite_errors(self.path):
            trial = self._trial(number)
        if trial is None:
            raise JournalError(
                f"no trial {number} in {self.path.parent}: it has {len(self.trials())}, from 0"
            )
        return trial

    def trials(self) -> tuple[CampaignTrial, ...]:
        """Every trial, by number."""
        with sqlite_errors(self.path):
            rows = self._connection.execute(f"SELECT {TRIAL_COLUMNS} FROM trial ORDER BY number").fetchall()
        return tuple(_trial(row) for row in rows)

    def events(self) -> tuple[Event, ...]:
        """Every event, oldest first."""
        with sqlite_errors(self.path):
            return self._events("ORDER BY seq")

    def last_event(self, number: int) -> Event:
        """How a trial came to where it stands.

        Raises:
            JournalError: when the campaign has no trial of that number.
        """
        self.trial(number)
        return next(event for event in reversed(self.events()) if event.trial == number)

    def verify(self) -> None:
        """Checks the file, the hash chain, and that the trials are what the events add up to.

        Raises:
            JournalCorrupt: naming the first thing that is wrong.
        """
        with sqlite_errors(self.path), reading(self._connection):
            verdict = self._connection.execute("PRAGMA integrity_check").fetchone()[0]
            try:
                broken = self._inconsistency() if verdict == "ok" else verdict
            except ValueError as error:
                broken = str(error)
        if broken is not None:
            raise corrupt(self.path, broken)

    def _inconsistency(self) -> str | None:
        events, trials = self._events("ORDER BY seq"), self.trials()
        broken = broken_link(events, self.identity.genesis(self.name))
        if broken is None and replay(events) != {trial.number: trial for trial in trials}:
            return "its table of trials is not what its events add up to"
        return broken

    def _campaign(self) -> tuple[str, CampaignIdentity]:
        if not self._connection.execute("SELECT 1 FROM sqlite_master").fetchone():
            raise _absent(self.path)
        try:
            # Journals of svaedc 0.1.0 have nothing behind `approval`.
            row = self._connection.execute("SELECT * FROM campaign").fetchone()
            if row is None:
                raise corrupt(self.path, "it names no campaign")
            _, name, robot, setup, method, seed, model, pool, trials, approval, *later = row
            return name, CampaignIdentity(
                robot, setup, method, seed, model, pool, trials, Approval(approval), *later
            )
        except (ValueError, TypeError) as error:
            raise corrupt(self.path, str(error)) from error

    def _head(self) -> tuple[int, str]:
        last = self._connection.execute("SELECT seq, hash FROM event ORDER BY seq DESC LIMIT 1").fetchone()
        return last or (0, self.identity.genesis(self.name))

    def _trial(self, number: int) -> CampaignTrial | None:
        query = f"SELECT {TRIAL_COLUMNS} FROM trial WHERE number = ?"
        row = self._connection.execute(query, (number,)).fetchone()
        return _trial(row) if row else None

    def _events(self, clause: str, *values: str) -> tuple[Event, ...]:
        rows = self._connection.execute(f"SELECT {EVENT_COLUMNS} FROM event {clause}", values).fetchall()
        return tuple(_event(row) for row in rows)

    def _write(self, event: Event, trial: CampaignTrial) -> None:
        self._connection.execute(INSERT_EVENT, astuple(event))
        try:
            self._connection.execute(UPSERT_TRIAL, astuple(trial))
        except sqlite3.IntegrityError as taken:
            raise RobotTaken(
                f"robot {trial.robot!r} is taken: trial {trial.number} cannot be {event.new} while another "
                "trial is granted, running or unknown; wait for it, or resolve it"
            ) from taken


def create(path: Path, name: str, identity: CampaignIdentity) -> None:
    """Creates the journal of a campaign; changes nothing when the file already holds one.

    Args:
        path: of the file; its folder must exist.
        name: of the campaign, unlike any other's: a robot's ledger knows its trials by it.
        identity: what the campaign is.
    """
    values = (name, *astuple(identity))
    with sqlite_errors(path), closing(connect(path)) as connection, writing(connection):
        if connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'campaign'").fetchone():
            return
        for statement in SCHEMA:
            connection.execute(statement)
        marks = ", ".join("?" for _ in values)
        connection.execute(f"INSERT INTO campaign VALUES (1, {marks})", values)


def _absent(path: Path) -> JournalError:
    """For a folder without journal, or one whose creation was cut short."""
    return JournalError(f"no campaign in {path.parent}: name the folder of one, or start one there")


def _repeat(event: Event, number: int, new: State, who: str, body: str) -> Event:
    if (event.trial, event.new, event.who, event.body) != (number, new, who, body):
        raise KeyReused(
            f"key {event.idem!r} already stands for trial {event.trial} -> {event.new} by {event.who!r}; the "
            f"request for trial {number} -> {new} by {who!r} has other content: read the trial again first"
        )
    return event


def _forbidden(number: int, old: State | None, new: State, allowed: frozenset[State]) -> str:
    names = ", ".join(sorted(allowed)) or "nothing, it has ended"
    return f"trial {number} cannot go from {old or 'not existing'} to {new}; legal from there: {names}"


def _trial(row: tuple[Any, ...]) -> CampaignTrial:
    number, robot, state, *rest = row
    return CampaignTrial(number, robot, State(state), *rest)


def _event(row: tuple[Any, ...]) -> Event:
    seq, trial, old, new, *rest = row
    return Event(seq, trial, None if old is None else State(old), State(new), *rest)
