"""The rollout process, in a module of its own so that it loads nothing that only the driver needs."""

from workers import setups
from workers.collection.shard import ShardReport, collect_shard, require_same_code, require_working
from workers.dataset.folder import open_dataset
from workers.dataset.shards import Shard, sweep
from workers.dataset.storage.location import location
from workers.dataset.storage.temporary import writer
from workers.setups.user_bad import with_bad


class RolloutActor:
    """A process that rolls out shards of one dataset."""

    def __init__(self, setup: str, folder: str) -> None:
        self._dataset = open_dataset(location(folder))
        self._setup = with_bad(setups.load(setup), self._dataset.identity.bad_name)
        require_same_code(self._setup, self._dataset)
        require_working(self._setup, self._dataset.identity.seed)
        sweep(self._dataset.folder)  # what processes of this machine left, which no other can tell dead

    def ready(self) -> str:
        """The name under which this process writes files, once it has started and found its dataset."""
        return writer()

    def collect(self, shard: Shard) -> ShardReport:
        """One shard, from its first episode to its name in the dataset."""
        return collect_shard(self._setup, self._dataset, shard)
