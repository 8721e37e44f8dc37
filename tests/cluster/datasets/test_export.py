"""What `svaedc dataset export` refuses before it writes anything."""

import pytest

from cluster.datasets.export import FORMATS, export
from cluster.errors import UsageError, UserError
from tests.cluster.datasets.collecting import alone


def test_a_dataset_without_episodes_is_not_exported(tmp_path):
    empty = alone(tmp_path / "data", 0)
    with pytest.raises(UserError, match=r"data holds no episodes yet; collect some first"):
        export(empty, "npz", tmp_path / "out")
    assert not list(tmp_path.glob("out*"))


def test_an_unknown_format_is_told_before_a_folder_that_is_in_the_way(tmp_path):
    with pytest.raises(UsageError, match=r"unknown format 'npzz'.*did you mean 'npz'"):
        export(alone(tmp_path / "data", 0), "npzz", tmp_path)


@pytest.mark.parametrize("form", sorted(FORMATS))
def test_a_folder_that_is_there_is_never_written_into(tmp_path, form):
    (tmp_path / "out").mkdir()
    with pytest.raises(UserError, match="out exists already; choose a new folder"):
        export(alone(tmp_path / "data", 1), form, tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())
