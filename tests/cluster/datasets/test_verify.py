"""Everything that is wrong with a dataset, in one list."""

from cluster.datasets.verify import find_defects
from tests.cluster.datasets.collecting import alone
from workers.dataset.shards import Shard


def test_a_whole_dataset_has_no_defects_even_when_it_is_rolled_out_again(tmp_path):
    assert find_defects(alone(tmp_path, 1), rederive=1) == []


def test_defects_in_files_and_files_that_are_no_shards_are_both_listed(tmp_path):
    dataset = alone(tmp_path, 1)
    path = dataset.path(Shard(0, 1))
    path.write_bytes(path.read_bytes()[:-1])
    (tmp_path / "stranger.parquet").write_bytes(b"?")
    assert {defect.file for defect in find_defects(dataset, rederive=0)} == {path.name, "stranger.parquet"}
