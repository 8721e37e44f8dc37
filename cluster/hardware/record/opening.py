"""A campaign's journal in its folder, opened to be written or only to be looked at."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from cluster.errors import UserError
from cluster.hardware import journal
from cluster.hardware.events import utc_now
from cluster.hardware.journal import Journal


@contextmanager
def to_write(folder: Path) -> Iterator[Journal]:
    """The journal of the campaign in a folder.

    Args:
        folder: of the campaign.

    Yields:
        The journal, verified.

    Raises:
        JournalError: there is none, or it is damaged.
    """
    with closing(Journal(folder / journal.FILE, utc_now)) as opened:
        yield opened


@contextmanager
def to_read(folder: Path) -> Iterator[Journal]:
    """The journal, also where nothing can be written: SQLite needs files beside it, even to read.

    Args:
        folder: of the campaign.

    Yields:
        The journal, verified; nothing must be recorded in it.

    Raises:
        JournalError: there is none, or it is damaged.
        UserError: it cannot be read.
    """
    if os.access(folder, os.W_OK) or not folder.is_dir():
        with to_write(folder) as opened:
            yield opened
        return
    with tempfile.TemporaryDirectory(prefix="svaedc-") as name:
        try:
            for part in folder.glob(f"{journal.FILE}*"):
                shutil.copyfile(part, Path(name) / part.name)
        except OSError as error:
            raise UserError(f"cannot read the journal in {folder}: {error.strerror}") from error
        with to_write(Path(name)) as opened:
            opened.path = folder / journal.FILE
            yield opened
