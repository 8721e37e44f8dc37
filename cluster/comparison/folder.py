"""The folder of a comparison: it holds one comparison, and one command at a time works in it."""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from cluster import files
from cluster.comparison.records import NAME, RUNS, RunKey, Runs, append, read_trials, write_table
from cluster.errors import UserError
from cluster.optimization import methods
from svaedc.bo.loop import Trial
from workers.plug_ins import file_name
from workers.setups import registry as setups
from workers.setups.declared import changes, what_changed

IDENTITY = "comparison.json"
DECLARED = "setup_declares"
"""Of a user's own setup, a comparison also knows what it declared, to say what has changed."""
CODES = "method_digests"
"""It also knows the code of users' own methods, of those that it has runs of."""
CANDIDATES, NO_CANDIDATES = "candidates", "none"
"""It knows the SHA-256 of the table of candidates that its runs choose among."""
NO_CODES: Final[Mapping[str, str]] = MappingProxyType({})
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

    def claim(
        self, identity: Mapping[str, Any], model: str, codes: Mapping[str, str] = NO_CODES
    ) -> dict[str, Any]:
        """Begin a comparison here, or check that the one that is here is this one.

        Args:
            identity: what all its runs have in common.
            model: hash of the model; "" when no method asked for needs one. It becomes part of the comparison
                with the first method that does.
            codes: hashes of the files of users' own methods, by the methods' names. Each becomes part of the
                comparison with its method.

        Returns:
            The identity of the comparison, the model's hash included.

        Raises:
            UserError: the folder holds another comparison, or its `comparison.json` is damaged or gone.
        """
        found = self._identity(identity) if self._has_begun() else {**identity, "model": "", CODES: {}}
        wanted = {**identity, "model": model or found["model"]}
        for name, value in wanted.items():
            if found[name] not in (value, "", None):
                raise UserError(f"{self._refusal(name, found, wanted)} choose another folder with --out")
        self._require_codes(found[CODES], codes)
        known = {**found[CODES], **codes}
        whole = {**wanted, **({CODES: known} if known else {})}
        if (
            whole != {name: value for name, value in found.items() if value not in (None, {})}
            or not self._is_known()
        ):
            self.write(IDENTITY, json.dumps(whole, indent=2) + "\n")
        return {name: value for name, value in wanted.items() if name != DECLARED}

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

    def _refusal(self, name: str, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
        """Why the comparison that is here is not the one that is wanted; what differs first is named."""
        if name not in ("setup_digest", DECLARED):
            return f"{self} holds a comparison with {name} {found[name]!r}, not {wanted[name]!r};"
        file = file_name(wanted["setup"], setups.KIND)
        before, now = found.get(DECLARED), wanted.get(DECLARED)
        differing = changes(before, now) if before and now else ()
        since = f"the comparison in {self} was begun"
        if name == DECLARED:
            what = what_changed(differing, "setup")
            return (
                f"what {file} declares has changed since {since} ({what}), though the file has not: "
                "something that it imports or reads has; put that back as it was, or"
            )
        said = what_changed(differing, "setup") if before else "what in it, this folder does not tell"
        return f"{file} has changed since {since} ({said}); put the file back as it was, or"

    def _require_codes(self, found: Mapping[str, str], asked: Mapping[str, str]) -> None:
        """Refuse methods whose code has changed since runs of them were made."""
        for name, code in asked.items():
            if found.get(name, code) != code:
                raise UserError(
                    f"{file_name(name, methods.KIND)} has changed since the runs of {name} in {self} were "
                    "begun; put it back as it was, or choose another folder with --out"
                )

    def _is_known(self) -> bool:
        return (self.path / IDENTITY).exists()

    def _has_begun(self) -> bool:
        return self._is_known() or any((self.path / RUNS).iterdir())

    def _identity(self, expected: Mapping[str, Any]) -> dict[str, Any]:
        path = self.path / IDENTITY
        try:
            # Comparisons of before lack the digest, and what a user's setup declared.
            later: dict[str, Any] = {"setup_digest": "", DECLARED: None, CODES: {}, CANDIDATES: NO_CANDIDATES}
            found = {**later, **json.loads(path.read_text(encoding="utf-8"))}
            return {name: found[name] for name in (*expected, "model", CODES)}
        except FileNotFoundError as error:
            raise _unknown(path, "is gone, though there are runs") from error
        except (ValueError, TypeError, KeyError) as error:
            raise _unknown(path, "is damaged") from error


def _unknown(path: Path, reason: str) -> UserError:
    return UserError(
        f"{path} {reason}: what the runs beside it belong to cannot be known; put the file back, "
        "or choose another folder with --out"
    )
