"""`--json`: one JSON document on standard output, and nothing else there."""

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any

import typer

_OUTPUT, _ERRORS = 1, 2


@contextmanager
def one_document() -> Iterator[dict[str, Any]]:
    """Prints what the block puts into the document; whatever else is printed meanwhile goes to stderr.

    Compiled libraries, and processes that the block starts, write to the descriptor, so that is turned too.
    Nothing is printed when the block fails.

    Yields:
        The document, to be filled with plain values.
    """
    document: dict[str, Any] = {}
    sys.stdout.flush()
    kept = os.dup(_OUTPUT)
    os.dup2(_ERRORS, _OUTPUT)
    try:
        with redirect_stdout(sys.stderr):
            yield document
    finally:
        ctypes.CDLL(None).fflush(None)  # what C code has printed is still in its buffer
        os.dup2(kept, _OUTPUT)
        os.close(kept)
    from cluster.files import json_text

    typer.echo(json_text(document))
