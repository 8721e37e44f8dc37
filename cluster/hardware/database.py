"""The SQLite file beneath a hardware journal: tables, transactions, and what its errors mean."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cluster.errors import UserError
from cluster.hardware.states import ACTIVE

BUSY_SECONDS = 20.0
SCHEMA = (
    """CREATE TABLE IF NOT EXISTS campaign (id INTEGER PRIMARY KEY CHECK (id = 1), name TEXT NOT NULL,
       robot TEXT NOT NULL, setup TEXT NOT NULL, method TEXT NOT NULL, seed INTEGER NOT NULL,
       model TEXT NOT NULL, pool INTEGER NOT NULL, trials INTEGER NOT NULL,
       approval TEXT NOT NULL, draws INTEGER NOT NULL, codes TEXT NOT NULL,
       candidates TEXT NOT NULL, avoid REAL NOT NULL, first TEXT NOT NULL) STRICT""",
    """CREATE TABLE IF NOT EXISTS event (seq INTEGER PRIMARY KEY, trial INTEGER NOT NULL, old TEXT,
       new TEXT NOT NULL, at TEXT NOT NULL, who TEXT NOT NULL, idem TEXT NOT NULL UNIQUE,
       body TEXT NOT NULL, prev TEXT NOT NULL, hash TEXT NOT NULL UNIQUE) STRICT""",
    """CREATE TABLE IF NOT EXISTS trial (number INTEGER PRIMARY KEY, robot TEXT NOT NULL,
       state TEXT NOT NULL, kind TEXT NOT NULL, x_hex TEXT NOT NULL, sha256 TEXT NOT NULL,
       f REAL, y REAL, version INTEGER NOT NULL) STRICT""",
    # At most one trial can move a robot, whatever the code above this line does.
    f"""CREATE UNIQUE INDEX IF NOT EXISTS one_active_trial ON trial (robot)
        WHERE state IN ({", ".join(f"'{state}'" for state in sorted(ACTIVE))})""",
)


class JournalError(UserError):
    """The journal cannot be read or written."""


class JournalCorrupt(JournalError):  # noqa: N818 - names the state of the file
    """The journal is not what this program wrote."""


def connect(path: Path) -> sqlite3.Connection:
    """A connection for which a commit is on disk when it returns (WAL, `synchronous=FULL`)."""
    connection = sqlite3.connect(path, timeout=BUSY_SECONDS, isolation_level=None)
    # SQLite's own decoder reports damaged text like a full disk; this one raises UnicodeDecodeError.
    connection.text_factory = bytes.decode
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")
    return connection


@contextmanager
def writing(connection: sqlite3.Connection) -> Iterator[None]:
    """A transaction that locks out other writers from its start: what it read still holds when it writes."""
    with _transaction(connection, "BEGIN IMMEDIATE"):
        yield


@contextmanager
def reading(connection: sqlite3.Connection) -> Iterator[None]:
    """A transaction whose queries all see the same instant, and which no writer waits for."""
    with _transaction(connection, "BEGIN DEFERRED"):
        yield


@contextmanager
def sqlite_errors(path: Path) -> Iterator[None]:
    """Turns SQLite's errors into messages that say what to do.

    Raises:
        JournalError: when the file cannot be used now.
        JournalCorrupt: when its content is damaged.
    """
    try:
        yield
    except sqlite3.OperationalError as error:
        raise JournalError(
            f"cannot use the journal {path}: {error}; it needs a writable local disk with space left, "
            "and nothing is moved without it"
        ) from error
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
        raise corrupt(path, str(error)) from error


def corrupt(path: Path, what: str) -> JournalCorrupt:
    """The error for a damaged journal.

    Args:
        path: of the journal.
        what: is wrong with it.

    Returns:
        The error, to be raised.
    """
    return JournalCorrupt(
        f"the journal {path} is damaged: {what}; nothing will be granted. Keep the file, "
        "restore a copy of it, or start a campaign in another folder"
    )


@contextmanager
def _transaction(connection: sqlite3.Connection, begin: str) -> Iterator[None]:
    connection.execute(begin)
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        # SQLite has rolled back by itself after some errors, a full disk among them.
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise
