"""What a robot did, ever: an append-only record in which every line vouches for all lines before it."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from workers.host import durable

FIRST = "0" * 64
"""The first line follows this."""
CUT = "cut"
"""An event: the last line was cut off, by a power cut or a broken disk."""


class LedgerDamaged(RuntimeError):  # noqa: N818 - names the state of the file
    """The ledger is not what was written; nothing moves until a person has looked."""


@dataclass(frozen=True)
class LedgerEntry:
    """One line.

    Attributes:
        seq: from 1.
        at: UTC time, ISO 8601.
        event: what happened.
        facts: what is particular to it, plain values.
        prev: hash of the line before.
        hash: SHA-256 over all of the above.
    """

    seq: int
    at: str
    event: str
    facts: Mapping[str, Any]
    prev: str
    hash: str

    def expected_hash(self) -> str:
        """The hash that the other fields have."""
        fields = {name: value for name, value in asdict(self).items() if name != "hash"}
        return hashlib.sha256(canonical(fields)).hexdigest()


def canonical(value: Any) -> bytes:
    """JSON with one spelling per value.

    Raises:
        ValueError: the value holds NaN or infinity.
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


class Ledger:
    """The file of one robot; several processes may add to it.

    Args:
        path: of the file; its folder must exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def entries(self) -> list[LedgerEntry]:
        """Every line, oldest first; one that was cut off at the end is none, see `is_cut`.

        Raises:
            LedgerDamaged: a line was altered, or is missing.
            OSError: the file cannot be read.
        """
        whole, _ = self._content()
        return self._verified_entries(whole)

    @property
    def is_cut(self) -> bool:
        """Whether the last line was cut off: something was about to happen, and may have happened.

        Raises:
            OSError: the file cannot be read.
        """
        return bool(self._content()[1])

    def append(self, event: str, facts: Mapping[str, Any]) -> LedgerEntry:
        """Add a line; it is on disk when this returns.

        Args:
            event: what happened, or is about to.
            facts: what is particular to it, plain values.

        Returns:
            The line.

        Raises:
            LedgerDamaged: what is there is not whole.
            OSError: the disk is full or broken; nothing was added.
        """
        with durable.exclusively(self.path.with_suffix(".lock")):
            whole, rest = self._content()
            known = self._verified_entries(whole)
            if rest:
                known.append(self._close_cut(known, whole, rest))
            return self._write(known, event, facts)

    def _content(self) -> tuple[bytes, bytes]:
        """The whole lines, and what stands behind the last of them."""
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return b"", b""
        end = content.rfind(b"\n") + 1
        return content[:end], content[end:]

    def _verified_entries(self, whole: bytes) -> list[LedgerEntry]:
        """All lines; those that were verified before, and whose bytes are the same, are not parsed again."""
        seen = _SEEN.get(self.path, _Seen())
        if hashlib.sha256(whole[: seen.length]).digest() != seen.digest:
            seen = _Seen()
        found = list(seen.entries)
        for line in whole[seen.length :].split(b"\n")[:-1]:
            number, prev = len(found) + 1, found[-1].hash if found else FIRST
            entry = _parsed_entry(line)
            if entry is None or entry.hash != entry.expected_hash():
                raise self._damage(f"line {number} was altered")
            if (entry.seq, entry.prev) != (number, prev):
                raise self._damage(f"line {number} does not follow the one before it")
            found.append(entry)
        _SEEN[self.path] = _Seen(len(whole), hashlib.sha256(whole).digest(), tuple(found))
        return found

    def _close_cut(self, known: list[LedgerEntry], whole: bytes, rest: bytes) -> LedgerEntry:
        """Put a line in the place of one that was cut off, with what is left of that as evidence."""
        durable.replace(self.path, whole)
        return self._write(known, CUT, {"rest": rest.hex()})

    def _write(self, known: list[LedgerEntry], event: str, facts: Mapping[str, Any]) -> LedgerEntry:
        at = datetime.now(timezone.utc).isoformat()  # noqa: UP017 - also for Python 3.10
        made = LedgerEntry(len(known) + 1, at, event, dict(facts), known[-1].hash if known else FIRST, "")
        sealed = LedgerEntry(made.seq, made.at, made.event, made.facts, made.prev, made.expected_hash())
        durable.append(self.path, canonical(asdict(sealed)) + b"\n")
        return sealed

    def _damage(self, what: str) -> LedgerDamaged:
        return LedgerDamaged(
            f"the robot's ledger {self.path} is damaged: {what}. Nothing moves. Keep the file, find out "
            "which trials moved the robot, and restore a copy of it, or rename it: then every campaign asks "
            "for a person"
        )


@dataclass(frozen=True)
class _Seen:
    """The beginning of a file that was verified in this process: a robot's ledger grows for years."""

    length: int = 0
    digest: bytes = hashlib.sha256(b"").digest()
    entries: "tuple[LedgerEntry, ...]" = ()


_SEEN: "dict[Path, _Seen]" = {}


def _parsed_entry(line: bytes) -> "LedgerEntry | None":
    try:
        fields = json.loads(line)
        entry = LedgerEntry(**fields)
        return entry if canonical(asdict(entry)) == line and isinstance(entry.facts, dict) else None
    except (ValueError, TypeError, RecursionError):
        return None
