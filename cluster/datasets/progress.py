"""What a collection has done so far, and its record in MLflow while it goes on."""

import math
import time
from collections import defaultdict, deque
from dataclasses import dataclass, field
from functools import partial

from cluster.tracking import Run
from cluster.tracking.recorder import Recorder
from workers.collection.shard import ShardReport
from workers.dataset.shards import Shard

WINDOW_SECONDS = 600.0
LISTED = 4
"""Up to so many machines are named one by one; of more, the slowest and the fastest are."""


@dataclass
class Rates:
    """Episodes per second of every machine over the last minutes; one that fell silent is seen to be at 0.

    Attributes:
        window: of the last so many seconds.
        begin: when the work began, by the monotonic clock.
    """

    window: float = WINDOW_SECONDS
    begin: float = field(default_factory=time.monotonic)
    _finished: deque[tuple[float, str, int]] = field(default_factory=deque)
    _episodes: dict[str, int] = field(default_factory=dict)

    def add(self, machine: str, episodes: int) -> None:
        """Count episodes that a machine has just finished.

        Args:
            machine: its name.
            episodes: how many.
        """
        self._finished.append((time.monotonic(), machine, episodes))
        self._episodes[machine] = self._episodes.get(machine, 0) + episodes

    def now(self) -> dict[str, float]:
        """Episodes per second by machine, in the order of their names."""
        moment = time.monotonic()
        while self._finished and self._finished[0][0] < moment - self.window:
            _, machine, episodes = self._finished.popleft()
            self._episodes[machine] -= episodes
        seconds = max(min(moment - self.begin, self.window), 1e-9)
        return {machine: self._episodes[machine] / seconds for machine in sorted(self._episodes)}

    def note(self) -> str:
        """The machines' rates for a line of progress; nothing for one machine, whose rate is the total."""
        rates = self.now()
        if len(rates) < 2:
            return ""
        if len(rates) <= LISTED:
            return "".join(f", {machine} {rate:.1f}/s" for machine, rate in rates.items())
        slow, fast = min(rates, key=rates.__getitem__), max(rates, key=rates.__getitem__)
        return f", {len(rates)} machines from {slow} {rates[slow]:.1f}/s to {fast} {rates[fast]:.1f}/s"


RECORD_SECONDS = 30.0
"""So long passes between two records: each is a few tens of ms in which the driver does nothing else."""
CONSEQUENCE = "; the collection goes on, and its numbers are recorded at the end at the latest"
"""A person reads this behind the store's error when the store fails meanwhile."""


@dataclass
class CollectionProgress:
    """Counts and sums over the shards that this command has collected."""

    episodes: int = 0
    size: int = 0
    diverged: int = 0
    stopped: int = 0
    failed: int = 0
    bad: float = 0.0  # summed over episodes
    best: float = float("-inf")
    rollout_seconds: float = 0.0
    storage_seconds: float = 0.0
    retries: int = 0
    errors: dict[Shard, list[str]] = field(default_factory=lambda: defaultdict(list))
    planned: int = 0  # episodes of the plan
    rates: Rates = field(default_factory=Rates)
    begin: float = field(default_factory=time.monotonic)

    def add(self, report: ShardReport) -> None:
        """Count a finished shard."""
        self.episodes += report.shard.episodes
        self.size += report.size
        self.diverged += report.diverged
        self.stopped += report.stopped
        self.failed += report.failed
        self.bad += report.badness * report.shard.episodes
        self.best = max(self.best, report.best)
        self.rollout_seconds += report.rollout_seconds
        self.storage_seconds += report.storage_seconds
        self.rates.add(report.machine, report.shard.episodes)

    @property
    def seconds(self) -> float:
        """Wall time since the work began."""
        return time.monotonic() - self.begin

    @property
    def core_seconds(self) -> float:
        """CPU time of the rollout processes in rollouts and storage."""
        return self.rollout_seconds + self.storage_seconds

    @property
    def badness(self) -> float:
        """Mean y."""
        return self.bad / max(self.episodes, 1)

    @property
    def rate(self) -> float:
        """Episodes per second."""
        return self.episodes / max(self.seconds, 1e-9)

    def note(self) -> str:
        """What a person wants to know beside counts and rate."""
        failed = f", {self.failed} failed" if self.failed else ""
        return f"bad {self.badness:.2f}{failed}{self.rates.note()}"

    @property
    def failed_text(self) -> str:
        """How many episodes failed, for a line of counts; "" for none, as is usual."""
        return f"{self.failed} failed, " if self.failed else ""

    def metrics(self) -> dict[str, float]:
        """The counts as numbers for MLflow, by name."""
        rate = self.rate
        values = {
            "episodes": self.episodes,
            "episodes_per_second": rate,
            "seconds_left": (self.planned - self.episodes) / rate if rate and self.planned else math.nan,
            "badness": self.badness,
            "best_objective": self.best,
            "diverged": self.diverged,
            "stopped": self.stopped,
            "failed": self.failed,
            "bytes_per_episode": self.size / max(self.episodes, 1),
            "core_hours": self.core_seconds / 3600,
            "storage_share": self.storage_seconds / max(self.core_seconds, 1e-9),
            "retries": self.retries,
            **{f"machine/{name}/episodes_per_second": rate for name, rate in self.rates.now().items()},
        }
        return {name: float(value) for name, value in values.items()}


class ProgressRecorder:
    """Records counts now and then; a store that fails meanwhile must not end hours of work.

    Args:
        run: the MLflow run.
        interval: seconds between records.
    """

    def __init__(self, run: Run, interval: float = RECORD_SECONDS) -> None:
        self._run, self._interval = run, interval
        self._recorder = Recorder(CONSEQUENCE, interval)
        self._due = time.monotonic() + interval

    def record(self, counts: CollectionProgress) -> None:
        """Record the counts if their time has come."""
        if time.monotonic() < self._due:
            return
        self._recorder.record(partial(self._run.metrics, counts.metrics(), step=counts.episodes))
        self._due = time.monotonic() + self._interval
