"""The rollout process, in a module of its own so that it loads nothing that only the driver needs."""

from functools import partial

from workers import setups
from workers.attempts import Attempts
from workers.collection.shard import (
    ShardReport,
    collect_shard,
    require_same_code,
    require_working,
    roll_out,
)
from workers.dataset.folder import open_dataset
from workers.dataset.shards import Shard, sweep
from workers.dataset.storage.location import location
from workers.dataset.storage.temporary import writer
from workers.isolation import IsolatedAttempts
from workers.setups.user_bad import with_bad


class RolloutActor:
    """A process that rolls out shards of one dataset."""

    def __init__(self, setup: str, folder: str, episode_timeout: float) -> None:
        self._dataset = open_dataset(location(folder))
        identity = self._dataset.identity
        self._setup = with_bad(setups.load(setup), identity.bad_name).under(identity.gap)
        require_same_code(self._setup, self._dataset)
        require_working(self._setup, identity.seed)
        self._timeout = episode_timeout
        sweep(self._dataset.folder)  # what processes of this machine left, which no other can tell dead

    def ready(self) -> str:
        """The name under which this process writes files, once it has started and found its dataset."""
        return writer()

    def collect(self, shard: Shard) -> ShardReport:
        """One shard, from its first episode to its name in the dataset."""
        return self._collect(shard, Attempts)

    def collect_isolated(self, shard: Shard) -> ShardReport:
        """The same, with each episode's code in a process that it may end without harm to the others."""
        return self._collect(shard, IsolatedAttempts)

    def _collect(self, shard: Shard, attempts: type[Attempts | IsolatedAttempts]) -> ShardReport:
        trying = partial(roll_out, attempts=partial(attempts, timeout=self._timeout))
        return collect_shard(self._setup, self._dataset, shard, trying)
