"""The runs of a comparison on Ray Tune: a few at a time, each tried again from its last trial if it fails."""

import math
import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import Any

from ray import tune
from ray.tune import Callback, FailureConfig, ResultGrid, RunConfig, Stopper, TuneConfig, Tuner

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.worker import ComparisonJob, RunTrainable
from cluster.errors import UserError
from cluster.files import disk_error
from cluster.progress import ProgressLine, say
from cluster.runtime.tune import silence_tune

ERRORS = "errors.txt"
_RUN_FAILURES = 2
_COLOR = re.compile(r"\x1b\[\d*m")


@dataclass
class BestSoFar:
    """The best objective so far of every run, those of earlier commands included."""

    methods: Sequence[str]
    best: dict[RunKey, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return ", ".join(f"{name} {fmean(values):.2f}" for name, values in self._by_method() if values)

    def _by_method(self) -> Iterator[tuple[str, list[float]]]:
        for name in self.methods:
            yield name, [v for key, v in self.best.items() if key.method == name and not math.isnan(v)]


@dataclass
class Watch(Callback):
    """Shows trials as they end and hands on runs that are over.

    Attributes:
        progress: counts trials.
        best: shown beside it.
        ended: called with every run that is over, whole or not.
        disk: why the disk takes no more; "" while it does.
    """

    progress: ProgressLine
    best: BestSoFar
    ended: Callable[[RunKey], None]
    disk: str = ""

    def on_trial_result(
        self,
        iteration: int,  # noqa: ARG002
        trials: Any,  # noqa: ARG002
        trial: Any,
        result: dict[str, Any],
        **_: Any,
    ) -> None:
        """A run has made trials.

        Args:
            iteration: not used.
            trials: not used.
            trial: run, as Tune knows it.
            result: what `RunTrainable.step` returned.
            **_: not used.
        """
        self.disk = self.disk or result.get("disk", "")
        if "trials" in result:
            self.best.best[RunKey(**trial.config["run"])] = result["best"]
            self.progress.advance(result["trials"], f"best so far: {self.best}")

    def on_trial_complete(self, iteration: int, trials: Any, trial: Any, **_: Any) -> None:  # noqa: ARG002
        """A run ended.

        Args:
            iteration: not used.
            trials: not used.
            trial: run that ended, as Tune knows it.
            **_: not used.
        """
        self.ended(RunKey(**trial.config["run"]))

    def on_trial_recover(self, iteration: int, trials: Any, trial: Any, **_: Any) -> None:  # noqa: ARG002
        """A run failed, and Tune tries it again.

        Args:
            iteration: not used.
            trials: not used.
            trial: run that failed, as Tune knows it.
            **_: not used.
        """
        say(f"run {RunKey(**trial.config['run'])} failed and is tried again from its last trial")

    def __getstate__(self) -> dict[str, Any]:
        """Nothing: Tune keeps a copy for a way to go on that is not used here."""
        return {}


class _FullDisk(Stopper):
    """Stops all runs once a disk takes no more trials."""

    def __init__(self) -> None:
        self._full = False

    def __call__(self, trial_id: str, result: dict[str, Any]) -> bool:  # noqa: ARG002
        """Looks at a trial; ends no single run."""
        self._full = self._full or "disk" in result
        return False

    def stop_all(self) -> bool:
        """Whether a disk is full."""
        return self._full


def submit(job: ComparisonJob, missing: Sequence[RunKey], slots: int, watch: Watch) -> UserError | None:
    """Bring runs to their end, `slots` of them at the same time.

    Args:
        job: what all runs share.
        missing: runs that are not whole.
        slots: runs at the same time, one CPU each.
        watch: is told of trials, and of runs that are over.

    Returns:
        What to tell of runs that kept failing; None where all are whole.

    Raises:
        UserError: the disk is full; what was finished is kept.
    """
    silence_tune()
    grid = tune.grid_search([{"method": key.method, "run": key.run} for key in missing])
    with tempfile.TemporaryDirectory(prefix="svaedc-tune-") as storage:
        results = Tuner(
            tune.with_resources(RunTrainable, {"cpu": 1}),
            param_space={"job": job, "run": grid},
            tune_config=TuneConfig(max_concurrent_trials=slots, reuse_actors=True),
            run_config=RunConfig(
                name="runs",
                storage_path=storage,
                failure_config=FailureConfig(max_failures=_RUN_FAILURES),
                callbacks=[watch],
                stop=_FullDisk(),
                verbose=0,
            ),
        ).fit()
    if watch.disk:
        raise disk_error(job.folder.path, watch.disk)
    return _failures(job.folder, results, len(missing)) if results.errors else None


def _failures(folder: ComparisonFolder, results: ResultGrid, asked: int) -> UserError:
    texts = [_COLOR.sub("", str(error)).strip() for error in results.errors]
    errors = folder.write(ERRORS, "\n\n".join(texts) + "\n")
    return UserError(
        f"{len(texts)} of {asked} runs kept failing, the first with: {texts[0].splitlines()[-1]}. "
        f"All errors are in {errors}. The other runs are kept, and the same command tries again"
    )
