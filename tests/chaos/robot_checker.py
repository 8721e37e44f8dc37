"""What happened to a robot, from files alone: SQLite, JSON lines and the arm's own log; none of our code."""

import hashlib
import json
import sqlite3
from dataclasses import dataclass, field
from pathlib import Path

TERMINAL = {"measured", "failed", "aborted", "rejected"}


@dataclass
class Account:
    """What the files say.

    Attributes:
        measured: f of every measured trial, by number.
        states: of all trials, by number.
        faults: sentences on what must never be.
    """

    measured: dict[int, float] = field(default_factory=dict)
    states: dict[int, str] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)


def look(folder: Path, home: Path, log: Path) -> Account:
    """Read a campaign, its robot's ledger, and what its arm did.

    Args:
        folder: of the campaign.
        home: of the robot.
        log: of the arm: `moment begin|command|stop values` a line.
    """
    account = Account()
    events = _events(folder, account)
    starts, ends = _motions(home, account)
    for trial, event in events:
        account.states[trial] = event["new"]
        if event["new"] == "measured":
            account.measured.setdefault(trial, json.loads(event["body"])["f"])
    _compare(account, events, starts, ends)
    begun = sum(line.split()[1] == "begin" for line in _lines(log))
    if begun > len(starts):
        account.faults.append(f"the arm began {begun} motions, and its ledger knows {len(starts)}")
    return account


def _compare(
    account: Account, events: list[tuple[int, dict]], starts: list[str], ends: dict[str, float]
) -> None:
    """Hold the journal against the robot's ledger."""
    if sum(state in ("granted", "running", "unknown") for state in account.states.values()) > 1:
        account.faults.append("two trials may move the robot")
    for name in starts:
        number = int(name.rpartition("-")[2])
        passed = [event["new"] for trial, event in events if trial == number]
        if "running" not in passed:
            account.faults.append(f"{name} moved the robot before the journal knew")
        if account.states.get(number) in ("proposed", "checked", "approved", "rejected"):
            account.faults.append(f"{name} moved the robot and counts as {account.states[number]}")
    for name, f in ends.items():
        number = int(name.rpartition("-")[2])
        if number in account.measured and account.measured[number] != f:
            account.faults.append(f"{name} measured {f} and the journal says {account.measured[number]}")


def _events(folder: Path, account: Account) -> list[tuple[int, dict]]:
    path = folder / "journal.sqlite"
    if not path.exists():
        return []
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as connection:
        connection.row_factory = sqlite3.Row
        try:
            rows = [dict(row) for row in connection.execute("SELECT * FROM event ORDER BY seq")]
        except sqlite3.OperationalError:  # its making was cut short
            return []
    previous = rows[0]["prev"] if rows else ""
    for number, row in enumerate(rows, start=1):
        said = row.pop("hash")
        text = json.dumps(row, sort_keys=True, separators=(",", ":"))
        if (
            row["seq"] != number
            or row["prev"] != previous
            or hashlib.sha256(text.encode()).hexdigest() != said
        ):
            account.faults.append(f"event {number} of the journal breaks the chain")
        previous = said
    return [(row["trial"], row) for row in rows]


def _motions(home: Path, account: Account) -> tuple[list[str], dict[str, float]]:
    """Names of the trials that started, and f of those that ended."""
    path = home / "ledger.jsonl"
    starts, ends, moving, previous = [], {}, "", None
    content = path.read_bytes() if path.exists() else b""
    for line in content[: content.rfind(b"\n") + 1].splitlines():
        entry = json.loads(line)
        if previous is not None and entry["prev"] != previous:
            account.faults.append(f"line {entry['seq']} of the ledger breaks the chain")
        previous, trial = entry["hash"], entry["facts"].get("trial")
        if entry["event"] == "started":
            if trial in starts:
                account.faults.append(f"{trial} moved the robot twice")
            starts.append(trial)
            moving = trial
        elif entry["event"] == "ended":
            if trial != moving:
                account.faults.append(f"{trial} ended while {moving or 'nothing'} was moving")
            ends[trial], moving = entry["facts"]["measurement"]["f"], ""
    return starts, ends


def _lines(log: Path) -> list[str]:
    return log.read_text(encoding="utf-8").splitlines() if log.exists() else []
