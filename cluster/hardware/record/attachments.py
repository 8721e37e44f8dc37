"""Files that belong to trials: kept by the hash of their bytes, and listed in lines that are chained."""

import hashlib
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from uuid import uuid4

import pyarrow
import pyarrow.csv
import pyarrow.parquet

from cluster.errors import UsageError, UserError
from cluster.files import turn_in
from workers.host import durable
from workers.host.ledger import Ledger, LedgerDamaged

LIST: Final = "attachments.jsonl"
FOLDER: Final = "attachments"
ATTACHED: Final = "attached"
_BLOCK = 1 << 20


@dataclass(frozen=True)
class Attachment:
    """One file of one trial.

    Attributes:
        trial: its number.
        name: of the file, as it was called.
        sha256: of its bytes.
        size: in bytes.
        who: attached it.
        note: what it shows; "" for nothing.
        at: UTC time, ISO 8601.
    """

    trial: int
    name: str
    sha256: str
    size: int
    who: str
    note: str
    at: str

    @property
    def file(self) -> str:
        """Its path in the campaign's folder."""
        suffix = re.fullmatch(r".*(\.[a-z0-9]{1,8})", self.name.lower(), re.DOTALL)
        return f"{FOLDER}/{self.sha256}{suffix.group(1) if suffix else ''}"


def attachments(folder: Path) -> tuple[Attachment, ...]:
    """Every file that belongs to the trials of a campaign, oldest first; nothing is written.

    Args:
        folder: of the campaign.

    Returns:
        The files.

    Raises:
        UserError: the list is damaged, or cannot be read.
    """
    try:
        entries = Ledger(folder / LIST).entries()
    except LedgerDamaged as error:
        raise UserError(f"the list of attachments is damaged: {error}") from error
    except OSError as error:
        raise UserError(f"cannot read {folder / LIST}: {error.strerror}") from error
    known = [name for name in Attachment.__dataclass_fields__ if name != "at"]
    return tuple(
        Attachment(**{name: entry.facts[name] for name in known}, at=entry.at)
        for entry in entries
        if entry.event == ATTACHED
    )


def attach(folder: Path, trial: int, path: Path, who: str, note: str) -> Attachment:
    """Keep a copy of a file with a trial; one that is there already is not kept twice.

    Args:
        folder: of the campaign.
        trial: its number.
        path: of the file.
        who: attaches it; recorded for good.
        note: what it shows; recorded for good.

    Returns:
        The attachment, new or already there.

    Raises:
        UsageError: there is no such file.
        UserError: it cannot be read or kept; nothing was recorded.
    """
    if not path.is_file():
        raise UsageError(f"there is no file {path} to attach: name one")
    try:
        with turn_in(folder / FOLDER):
            return _keep(folder, trial, path, who, note)
    except LedgerDamaged as error:
        raise UserError(f"the list of attachments is damaged: {error}") from error
    except OSError as error:
        raise UserError(f"cannot attach {path}: {error.strerror or error}: {error.filename or ''}") from error


def _keep(folder: Path, trial: int, path: Path, who: str, note: str) -> Attachment:
    """Keep it, unless it is there; nobody else keeps anything meanwhile."""
    listed = attachments(folder)  # a damaged list takes no more, and no copy is made
    digest, size, unfinished = _copy(path, folder / FOLDER)
    made = Attachment(trial, path.name, digest, size, who, note, "")
    known = [each for each in listed if (each.trial, each.sha256) == (trial, digest)]
    unfinished.replace(folder / made.file)
    durable.sync_folder(folder / FOLDER)
    if known:
        return known[0]
    facts = {name: getattr(made, name) for name in Attachment.__dataclass_fields__ if name != "at"}
    entry = Ledger(folder / LIST).append(ATTACHED, facts)
    return Attachment(**{**facts, "at": entry.at})


def take_over(folder: Path, recorded: Path, trial: int) -> None:
    """Attach what was recorded at the robot, tables as Parquet, and leave nothing behind there.

    Args:
        folder: of the campaign.
        recorded: folder of one trial at the robot's home; it may be missing.
        trial: its number.

    Raises:
        UserError: a file cannot be kept; it stays where it is.
    """
    for path in sorted(recorded.iterdir()) if recorded.is_dir() else ():
        if path.is_file() and not path.is_symlink():
            with _as_parquet(path) as kept:
                attach(folder, trial, kept, "the robot", "")
            path.unlink()
    with suppress(OSError):  # missing, or a driver made a folder in it
        recorded.rmdir()


def damage(folder: Path) -> Iterator[str]:
    """Say which kept files are missing, or are not what they were.

    Args:
        folder: of the campaign.

    Yields:
        A sentence for each.
    """
    for each in attachments(folder):
        try:
            with (folder / each.file).open("rb") as file:
                found = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            yield f"{each.file} ({each.name} of trial {each.trial}) cannot be read: {error.strerror}"
            continue
        if found != each.sha256:
            yield f"{each.file} ({each.name} of trial {each.trial}) has other bytes than were attached"


def _copy(path: Path, into: Path) -> tuple[str, int, Path]:
    """A copy of a file, durable and not yet under its name, with its SHA-256 and its size."""
    unfinished = into / f".{uuid4().hex}.unfinished"
    digest, size = hashlib.sha256(), 0
    try:
        with path.open("rb") as source, unfinished.open("wb") as target:
            while block := source.read(_BLOCK):
                digest.update(block)
                size += target.write(block)
            target.flush()
            os.fsync(target.fileno())
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise
    return digest.hexdigest(), size, unfinished


@contextmanager
def _as_parquet(path: Path) -> Iterator[Path]:
    """A table as Parquet under the same name; what is no table, as it is."""
    if path.suffix != ".csv":
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="svaedc-") as name:
        table = Path(name) / f"{path.stem}.parquet"
        try:
            pyarrow.parquet.write_table(pyarrow.csv.read_csv(path), table)
        except pyarrow.ArrowInvalid:  # a driver's own, in another form
            table = path
        yield table
