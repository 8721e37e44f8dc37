"""Files of a comparison: one growing record per run, and one table of all trials."""

import fcntl
import json
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count, takewhile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cluster.errors import UserError
from cluster.files import json_text, replacing
from svaedc.analysis.summary import Row
from svaedc.bo.loop import Trial
from workers.dataset.storage.location import arrow_name

RUNS = "runs"
NAME = re.compile(r"(?P<method>.+)-(?P<run>\d{5,})\.jsonl")


@dataclass(frozen=True, order=True)
class RunKey:
    """A method and the seed it runs with."""

    method: str
    run: int

    def __str__(self) -> str:
        return f"{self.method} {self.run}"

    def path(self, folder: Path) -> Path:
        """Where the run's trials are recorded."""
        return folder / RUNS / f"{self.method}-{self.run:05d}.jsonl"


Runs = Mapping[RunKey, list[Trial]]
"""It holds all trials of all runs, in order."""


def append(path: Path, trial: Trial) -> None:
    """Add a trial to a run's record; it is on disk when this returns.

    Args:
        path: of the record, which the first trial creates.
        trial: the next one of the run.
    """
    with path.open("ab+") as file:
        # A worker whose driver died may still be at it.
        fcntl.flock(file, fcntl.LOCK_EX)
        _drop_torn_line(file)
        file.write(json_text(_fields(trial), indent=None).encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())


def _drop_torn_line(file: BinaryIO) -> None:
    """Remove a last line that a kill or a full disk cut off."""
    file.seek(0)
    text = file.read()
    whole = text.rfind(b"\n") + 1
    if whole < len(text):
        file.truncate(whole)


def read_trials(path: Path) -> list[Trial]:
    """The trials of a run so far, up to the first that is absent.

    A last line that was cut off counts as absent. Of a trial recorded twice, by a worker that outlived its
    driver, the first counts; they differ in nothing but their seconds.

    Raises:
        UserError: a whole line is no trial.
    """
    if not path.exists():
        return []
    trials: dict[int, Trial] = {}
    for number, line in enumerate(path.read_bytes().split(b"\n")[:-1], start=1):
        try:
            trial = _trial(json.loads(line))
        except (ValueError, TypeError, KeyError) as error:
            raise UserError(
                f"line {number} of {path} is not the record of a trial; delete the file, "
                "and the same command repeats that one run"
            ) from error
        trials.setdefault(trial.index, trial)
    return [trials[index] for index in takewhile(trials.__contains__, count())]


def _trial(line: dict[str, Any]) -> Trial:
    """The trial of a line; a failed one holds null, or NaN, which older versions wrote."""
    index, x = line.pop("trial"), np.array(line.pop("x"), dtype=np.float32)
    numbers = {name: math.nan if line[name] is None else line[name] for name in ("f", "y", "best")}
    return Trial(**{**line, **numbers}, index=index, x=x)


def rows(runs: Runs) -> list[Row]:
    """What the statistics need of every trial."""
    return [
        Row(key.method, key.run, trial.index, trial.f, trial.success)
        for key, trials in runs.items()
        for trial in trials
    ]


def write_table(path: Path, runs: Runs, facts: Mapping[str, str]) -> None:
    """One row per trial of all runs, in Parquet; the file is whole, or as it was before.

    Args:
        path: of the file.
        runs: all trials.
        facts: the columns that all rows share, by name.

    Raises:
        OSError: the disk takes no more.
    """
    records = [
        {**facts, "method": key.method, "run": key.run, **_fields(trial)}
        for key, trials in runs.items()
        for trial in trials
    ]
    with replacing(path) as unfinished:
        pq.write_table(pa.Table.from_pylist(records), arrow_name(unfinished), compression="zstd")


def _fields(trial: Trial) -> dict[str, Any]:
    """A trial as plain values, in the order of the table."""
    return {
        "trial": trial.index,
        "f": trial.f,
        "y": trial.y,
        "best": trial.best,
        "success": trial.success,
        "status": trial.status,
        "seconds": trial.seconds,
        "stop": trial.stop,
        "x": trial.x.tolist(),
    }
