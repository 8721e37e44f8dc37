"""A disk that is full loses nothing, whatever was being written when it was."""

import pytest

from tests.chaos.disks import fill_each, refusal, small
from tests.chaos.drivers import (
    PATIENCE,
    Blows,
    collected_here,
    command,
    published,
    require_part,
    require_same,
    seed,
)
from workers.dataset.folder import MANIFEST
from workers.dataset.storage.temporary import WRITING

pytestmark = pytest.mark.chaos

DISKS, SMALLEST, LARGEST = 3, 8, 4000
"""How many are filled by `svaedc collect`, and their bounds in kB; the dataset needs 7,000."""
EPISODES = 40
STEPS = (*(f"size={size}k" for size in range(4, 64, 4)), *(f"nr_inodes={files}" for files in range(2, 16)))
"""Full at every step of the first shards: kB in pages of 4, and files, of which even an empty one is one."""


@pytest.fixture
def disk(tmp_path):
    """A folder where a small disk may be mounted."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if reason := refusal(folder):
        pytest.skip(f"a small disk cannot be mounted here, even in a name space: {reason}")
    return folder


def test_no_size_of_a_full_disk_loses_or_changes_a_byte(tmp_path, undisturbed, drivers, disk):
    blows = Blows(tmp_path, seed())
    print(f"CHAOS_SEED={blows.seed}")
    for number, size in enumerate(blows.rng.integers(SMALLEST, LARGEST, size=DISKS)):
        out, log = tmp_path / f"dataset-{number}", tmp_path / f"disk-{number}.log"
        out.mkdir()
        arguments = small(f"size={size}k", disk, out, command(disk, tmp_path / "mlflow.db"))
        assert drivers.start(arguments, log).wait(PATIENCE) == 1, log.read_text()
        assert "No space left on device" in log.read_text()
        assert "Traceback" not in log.read_text()
        assert not list(out.glob(f"{WRITING}/*"))
        require_part(out, undisturbed)
        print(f"full at {size} kB: {len(list(out.glob('*.parquet')))} shards safe")
    assert drivers.start(command(out, tmp_path / "mlflow.db"), log).wait(PATIENCE) == 0, log.read_text()
    require_same(out, undisturbed, [])


def test_a_disk_that_is_full_at_any_step_of_a_shard_keeps_nothing_half_done(tmp_path, disk):
    expected = published(collected_here(tmp_path / "dataset", EPISODES).folder)
    assert fill_each(disk, tmp_path, STEPS, EPISODES) == ""
    for step in STEPS:
        out = tmp_path / step
        assert not list(out.glob(f"{WRITING}/*")), step
        assert published(out).keys() < expected.keys(), step
        assert MANIFEST in published(out) or not published(out), step
        collected_here(out, EPISODES)
        assert published(out) == expected, step
    print(f"{len(STEPS)} disks filled step by step")
