"""The cells of a study: each is computed once, in a process of one thread, and kept as a line of JSON."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

from cluster.progress import ProgressLine, duration, say

Result = Mapping[str, Any]
Cell = TypeVar("Cell")


@dataclass(frozen=True)
class Study:
    """A folder with the results of cells.

    Attributes:
        folder: of `cells.jsonl`, the table and the figure.
    """

    folder: Path

    def kept(self) -> dict[str, Result]:
        """Results by cell; a line that was cut off in the middle counts as not computed."""
        path = self.folder / "cells.jsonl"
        found = {}
        for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
            try:
                entry = json.loads(line)
            except ValueError:
                continue
            found[name(entry["cell"])] = entry["result"]
        return found

    def keep(self, cell: Any, result: Result) -> None:
        """Add a result at the end, on a line of its own, and wait until the disk has it."""
        with (self.folder / "cells.jsonl").open("a", encoding="utf-8") as file:
            file.write("\n" * (file.tell() > 0) + json.dumps({"cell": asdict(cell), "result": result}))
            file.flush()
            os.fsync(file.fileno())


def arguments(description: str | None, folder: str) -> argparse.ArgumentParser:
    """What every study is told: its dataset, and where and with how many processes it works."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--dataset", required=True)
    parser.add_argument("--out", type=Path, default=Path("study-results") / folder)
    parser.add_argument("--cache", default=str(Path("~/.cache/svaedc").expanduser()))
    parser.add_argument("--processes", type=int, default=1)
    return parser


def name(cell: Mapping[str, Any]) -> str:
    """The same for the same values."""
    return json.dumps(cell, sort_keys=True)


def results(
    study: Study,
    cells: Sequence[Cell],
    compute: Callable[[Cell], Result],
    seconds: float,
    processes: int,
) -> list[Result]:
    """The results of all cells, in their order; those that are kept already are not computed again.

    Args:
        study: where they are kept.
        cells: dataclasses of plain values.
        compute: a function of a module, called in another process.
        seconds: that one cell takes, roughly, to tell the cost of all beforehand.
        processes: at the same time, of one thread each.
    """
    study.folder.mkdir(parents=True, exist_ok=True)
    kept = study.kept()
    missing = [cell for cell in cells if name(asdict(cell)) not in kept]
    cost = duration(seconds * len(missing))
    say(
        f"{len(missing)} of {len(cells)} cells are left, about {cost} of CPU time, {processes} at a time; "
        f"results are kept in {study.folder}, and the same command goes on from there"
    )
    # Read by the linear algebra of the processes that are started now.
    os.environ["OMP_NUM_THREADS"] = "1"
    with ProgressLine("cells", len(cells), len(cells) - len(missing)) as progress:
        for cell, result in _computed(missing, compute, processes):
            study.keep(cell, result)
            progress.advance(1, "")
            say(f"{cell}: {_brief(result)}")
    kept = study.kept()
    return [kept[name(asdict(cell))] for cell in cells]


def _computed(missing: Sequence[Any], compute: Callable[[Any], Result], processes: int) -> Any:
    if not missing:
        return
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        futures = {pool.submit(compute, cell): cell for cell in missing}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _brief(result: Result) -> str:
    parts = []
    for key, value in result.items():
        if isinstance(value, Mapping):
            parts.append(f"{key}: {_brief(value)};")
        elif isinstance(value, float):
            parts.append(f"{key} {value:.3g}")
    return " ".join(parts)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def written(path: Path, text: str) -> None:
    """Keep a text, and show it."""
    path.write_text(text, encoding="utf-8")
    sys.stdout.write(text)
