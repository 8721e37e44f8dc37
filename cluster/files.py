"""Files that appear whole: written beside their place, then moved there."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from workers.dataset.publication import synchronise


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Where to write a file that takes the place of `path`, durably, once the block has ended well.

    One process at a time may do so. What a killed one left behind, the next overwrites.
    """
    unfinished = path.with_name(f".unfinished-{path.name}")
    try:
        yield unfinished
        synchronise(unfinished)
        unfinished.replace(path)
        synchronise(path.parent)
    finally:
        unfinished.unlink(missing_ok=True)
