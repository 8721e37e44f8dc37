"""Files of a comparison: one growing record per run, and one table of all trials."""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from svaedc.comparison import Trial
from svaedc.statistics import Row

RUNS = "runs"


@dataclass(frozen=True, order=True)
class RunKey:
    """A method and the seed it runs with."""

    method: str
    run: int

    def path(self, folder: Path) -> Path:
        """Where the run's trials are recorded."""
        return folder / RUNS / f"{self.method}-{self.run:05d}.jsonl"


def append(path: Path, trial: Trial) -> None:
    """Add a trial to a run's record; it is on disk when this returns."""
    line = {
        "trial": trial.index,
        "f": trial.f,
        "y": trial.y,
        "best": trial.best,
        "success": trial.success,
        "status": trial.status,
        "seconds": trial.seconds,
        "stop": trial.stop,
        "x": [float(value) for value in trial.x],
    }
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")
        file.flush()
        os.fsync(file.fileno())


def recorded(path: Path) -> list[Trial]:
    """The trials of a run so far; a last line cut off by a crash is removed from the file."""
    if not path.exists():
        return []
    text = path.read_bytes()
    whole = text[: text.rfind(b"\n") + 1]
    if len(whole) < len(text):
        with path.open("r+b") as file:
            file.truncate(len(whole))
    return [_trial(json.loads(line)) for line in whole.splitlines()]


def _trial(line: dict[str, Any]) -> Trial:
    x = np.array(line.pop("x"), dtype=np.float32)
    return Trial(index=line.pop("trial"), x=x, **line)


def all_runs(folder: Path) -> Iterator[tuple[RunKey, list[Trial]]]:
    """Every run of a comparison that has begun, in order."""
    for path in sorted((folder / RUNS).glob("*.jsonl")):
        method, _, run = path.stem.rpartition("-")
        yield RunKey(method, int(run)), recorded(path)


def rows(folder: Path) -> list[Row]:
    """What the statistics need of every trial."""
    return [
        Row(key.method, key.run, trial.index, trial.f, trial.success)
        for key, trials in all_runs(folder)
        for trial in trials
    ]


def write_table(folder: Path, *, setup: str, gap: str) -> Path:
    """`trials.parquet`: one row per trial of all runs."""
    records = [
        {
            "setup": setup,
            "gap": gap,
            "method": key.method,
            "run": key.run,
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
        for key, trials in all_runs(folder)
        for trial in trials
    ]
    path = folder / "trials.parquet"
    temporary = path.with_suffix(".tmp")
    pq.write_table(pa.Table.from_pylist(records), temporary, compression="zstd")
    temporary.replace(path)
    return path
