"""The folder of a comparison: it holds one comparison, and one command at a time works in it."""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cluster import files
from cluster.comparison.records import NAME, RUNS, RunKey, Runs, append, read_trials, write_table
from cluster.errors import UserError
from svaedc.bo.loop import Trial

IDENTITY = "comparison.json"
TABLE = "trials.parquet"
SUMMARY = "summary.json"
FIGURE = "figure.png"
PAGE = "report.html"
FAILED_TRIALS = "failed"
"""What each failed trial failed of lies in this folder."""


@dataclass(frozen=True)
class ComparisonFolder:
    """The files of one comparison.

    Attributes:
        path: of the folder, absolute.
    """

    path: Path

    def __str__(self) -> str:
        return str(self.path)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keeps other commands out of the folder, which is created first; a dead one keeps nobody out.

        Raises:
            UserError: another command works in it, or it cannot be written.
        """
        with files.writing(self.path):
            (self.path / RUNS).mkdir(parents=True, exist_ok=True)
        refusal = (
            f"another comparison is at work in {self}; wait for its end, or choose another folder with --out"
        )
        with files.alone_in(self.path, refusal):
            yield

    def write(self, name: str, text: str) -> Path:
        """Write one of the folder's files; it is whole, or as it was before.

        Args:
            name: of the file.
            text: its whole content.

        Returns:
            Where it lies.

        Raises:
            UserError: the disk takes no more.
        """
        with files.writing(self.path):
            files.write_text(self.path / name, text)
        return self.path / name

    def claim(self, identity: Mapping[str, Any], model: str) -> dict[str, Any]:
        """Begin a comparison here, or check that the one that is here is this one.

        Args:
            identity: what all its runs have in common.
            model: hash of the model; "" when no method asked for needs one. It becomes part of the comparison
                with the first method that does.

        Returns:
            The identity of the comparison, the model's hash included.

        Raises:
            UserError: the folder holds another comparison, or its `comparison.json` is damaged or gone.
        """
        found = self._identity(identity) if self._has_begun() else {**identity, "model": ""}
        wanted = {**identity, "model": model or found["model"]}
        for name, value in wanted.items():
            if found[name] not in (value, ""):
                raise UserError(
                    f"{self} holds a comparison with {name} {found[name]!r}, not {value!r}; "
                    "choose another folder with --out"
                )
        if wanted != found or not (self.path / IDENTITY).exists():
            self.write(IDENTITY, json.dumps(wanted, indent=2) + "\n")
        return wanted

    def trials(self, key: RunKey) -> list[Trial]:
        """The trials of a run so far.

        Raises:
            UserError: its record is damaged.
        """
        return read_trials(key.path(self.path))

    def append(self, key: RunKey, trial: Trial) -> None:
        """Add a trial to the record of a run; it is on disk when this returns.

        Args:
            key: of the run.
            trial: its next one.

        Raises:
            OSError: the disk takes no more.
        """
        append(key.path(self.path), trial)

    def begin(self, key: RunKey, trial: int) -> None:
        """Note that a trial of a run is under way; a process that dies leaves the note.

        Args:
            key: of the run.
            trial: its index.

        Raises:
            OSError: the disk takes no more.
        """
        self._under_way(key).write_text(f"{trial}\n", encoding="utf-8")

    def under_way(self, key: RunKey) -> int | None:
        """The trial of a run that was begun last, whether or not it ended; None before the first."""
        try:
            return int(self._under_way(key).read_text(encoding="utf-8"))
        except (FileNotFoundError, ValueError):  # none yet, or cut off by a full disk
            return None

    def end(self, key: RunKey) -> None:
        """Forget which trial of a run was under way: it is whole."""
        self._under_way(key).unlink(missing_ok=True)

    def _under_way(self, key: RunKey) -> Path:
        return key.path(self.path).with_suffix(".under-way")

    def keep_failure(self, key: RunKey, trial: int, text: str) -> Path:
        """Keep what a failed trial failed of.

        Args:
            key: of the run.
            trial: its index.
            text: for people.

        Returns:
            Where it lies.

        Raises:
            OSError: the disk takes no more.
        """
        path = self.path / FAILED_TRIALS / f"{key.method}-{key.run:05d}-{trial:03d}.txt"
        path.parent.mkdir(exist_ok=True)
        files.write_text(path, text)
        return path

    def failures(self) -> list[Path]:
        """The accounts of failed trials, in the order of their names."""
        return sorted((self.path / FAILED_TRIALS).glob("*.txt"))

    def begun_keys(self) -> list[RunKey]:
        """Every run that has begun, in order; of files that are no run's, such as copies, nothing is said."""
        matches = (NAME.fullmatch(path.name) for path in (self.path / RUNS).glob("*.jsonl"))
        return sorted(RunKey(match["method"], int(match["run"])) for match in matches if match)

    def runs(self) -> dict[RunKey, list[Trial]]:
        """The trials of every run that has begun, in order."""
        return {key: self.trials(key) for key in self.begun_keys()}

    def write_table(self, runs: Runs, facts: Mapping[str, str]) -> Path:
        """`trials.parquet`: one row per trial of all runs.

        Args:
            runs: all trials.
            facts: the columns that all rows share, by name.

        Returns:
            Where it lies.

        Raises:
            UserError: the disk takes no more.
        """
        with files.writing(self.path):
            write_table(self.path / TABLE, runs, facts)
        return self.path / TABLE

    def holds(self, names: Iterable[str]) -> bool:
        """Whether all of these files are here."""
        return all((self.path / name).exists() for name in names)

    def _has_begun(self) -> bool:
        return (self.path / IDENTITY).exists() or any((self.path / RUNS).iterdir())

    def _identity(self, expected: Mapping[str, Any]) -> dict[str, Any]:
        path = self.path / IDENTITY
        try:
            # Comparisons of before lack the digest.
            found = {"setup_digest": "", **json.loads(path.read_text(encoding="utf-8"))}
            return {name: found[name] for name in (*expected, "model")}
        except FileNotFoundError as error:
            raise _unknown(path, "is gone, though there are runs") from error
        except (ValueError, TypeError, KeyError) as error:
            raise _unknown(path, "is damaged") from error


def _unknown(path: Path, reason: str) -> UserError:
    return UserError(
        f"{path} {reason}: what the runs beside it belong to cannot be known; put the file back, "
        "or choose another folder with --out"
    )
