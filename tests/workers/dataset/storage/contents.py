"""What lies in a dataset's folder, and what is wrong with it."""

from workers.dataset.folder import Dataset
from workers.dataset.inventory import inventory
from workers.dataset.shards import Shard
from workers.dataset.storage.location import Location
from workers.dataset.storage.temporary import WRITING
from workers.dataset.verification import verify

FIRST, MIDDLE, LAST = Shard(0, 8), Shard(8, 16), Shard(16, 20)


def content(folder: Location) -> dict[str, bytes]:
    paths = [path for path in folder.iterdir() if path.name != WRITING]
    return {path.name: path.read_bytes() for path in paths}


def problems(dataset: Dataset) -> dict[str, str]:
    found = [*inventory(dataset), *(each for _, several in verify(dataset) for each in several)]
    return {problem.file: problem.what for problem in found}
