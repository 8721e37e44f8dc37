"""`svaedc hardware export` and `report`: a campaign for other programs, and for people."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Final

import pyarrow.parquet

from cluster.errors import UsageError
from cluster.files import replacing, write_text
from cluster.hardware.events import canonical
from cluster.hardware.record import opening
from cluster.hardware.record.attachments import attachments
from cluster.hardware.record.page import page
from cluster.hardware.record.rows import as_csv, as_table, rows

PARQUET: Final = "parquet"


def lines(folder: Path) -> Iterator[str]:
    """The journal as JSON lines: the campaign first, then every event, oldest first.

    Args:
        folder: of the campaign; nothing is written into it.

    Yields:
        Lines without their end.
    """
    with opening.to_read(folder) as journal:
        yield canonical({"campaign": journal.name, **journal.identity.facts()})
        for event in journal.events():
            yield canonical(asdict(event))


def export(folder: Path, form: str, out: Path | None) -> str:
    """Write a campaign in one of `FORMS`.

    Args:
        folder: of the campaign; nothing is written into it.
        form: jsonl, csv or parquet.
        out: file to write; None for returning the text.

    Returns:
        The text where there is no file; "" otherwise.

    Raises:
        UsageError: there is no such form, or Parquet has no file to go to.
        UserError: there is no campaign, its journal is damaged, or the file cannot be written.
    """
    if form not in FORMS:
        raise UsageError(f"--as must be one of {', '.join(FORMS)}, got {form!r}")
    if form == PARQUET:
        if out is None:
            raise UsageError("parquet is no text: name a file with --out")
        with opening.to_read(folder) as journal, replacing(out) as unfinished:
            pyarrow.parquet.write_table(as_table(rows(journal)), unfinished)
        return ""
    text = TEXTS[form](folder)
    if out is None:
        return text
    write_text(out, text)
    return ""


def report(folder: Path, out: Path) -> None:
    """Write a campaign as a page that opens anywhere.

    Args:
        folder: of the campaign; nothing is written into it.
        out: the file.

    Raises:
        UserError: there is no campaign, its journal is damaged, or the file cannot be written.
    """
    with opening.to_read(folder) as journal:
        identity, files = journal.identity.facts(), attachments(folder)
        text = page(journal.name, identity, rows(journal), journal.events(), files)
    write_text(out, text)


def _journal(folder: Path) -> str:
    return "".join(f"{line}\n" for line in lines(folder))


def _csv(folder: Path) -> str:
    with opening.to_read(folder) as journal:
        return as_csv(rows(journal))


TEXTS: Final[Mapping[str, Callable[[Path], str]]] = MappingProxyType({"jsonl": _journal, "csv": _csv})
FORMS: Final = (*TEXTS, PARQUET)
