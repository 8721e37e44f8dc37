"""A folder holds one comparison, and one command at a time works in it."""

import shutil

import pytest

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.plan import Grid
from cluster.comparison.records import RunKey, append
from cluster.config import CompareSettings
from cluster.errors import UsageError, UserError
from tests.cluster.comparison.comparing import table, trial


@pytest.mark.parametrize("damage", ["no", "[]", "{}", '{"setup": "franka"}', "\x00"])
@pytest.mark.slow
def test_a_damaged_identity_is_refused_naming_its_file(compared, tmp_path, damage):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "comparison.json").write_text(damage)
    with pytest.raises(UserError, match=r"comparison.json is damaged: .* put the file back"):
        compared("random")
    assert (tmp_path / "out" / "comparison.json").read_text() == damage


@pytest.mark.slow
def test_runs_without_their_identity_are_refused(compared, tmp_path):
    (tmp_path / "out" / "runs").mkdir(parents=True)
    append(RunKey("random", 1000).path(tmp_path / "out"), trial(0))
    with pytest.raises(UserError, match=r"comparison\.json is gone, though there are runs"):
        compared("random")


@pytest.mark.slow
def test_two_comparisons_at_once_in_one_folder_are_refused(compared, tmp_path):
    with (
        ComparisonFolder(tmp_path / "out").alone(),
        pytest.raises(UserError, match=r"another comparison is at work in .*/out; wait for its end"),
    ):
        compared("random")
    assert len(table(compared("random", runs=1))) == 4


@pytest.mark.slow
def test_runs_for_tuning_and_runs_for_reporting_share_no_folder(compared, tmp_path):
    (tmp_path / "out" / "runs").mkdir(parents=True)
    append(RunKey("random", 3).path(tmp_path / "out"), trial(0))
    with pytest.raises(UserError, match=r"another purpose; choose another folder with --out: .* 3 to 1001"):
        compared("random")
    with pytest.raises(UsageError, match=r"--seed and --runs: .* got 999 to 1000"):
        Grid(("random",), seed=999, runs=2)


@pytest.mark.slow
def test_another_comparison_in_the_folder_is_refused_naming_the_difference(compared):
    compared("random", runs=1)
    with pytest.raises(UserError, match="holds a comparison with pool_size 200, not 300"):
        compared("random", settings=CompareSettings(slots=2, pool_size=300))


def test_a_folder_that_cannot_be_written_is_refused_naming_it(compared, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(UserError, match=r"cannot write to .*/file/out: .*Not a directory.*--out"):
        compared("random", folder=tmp_path / "file" / "out")


@pytest.mark.slow
def test_runs_that_would_vanish_beside_longer_ones_are_refused(compared, capsys):
    out = compared("random", runs=1)
    whole = table(out)
    with pytest.raises(UserError, match=r"holds runs of 2 suggested trials.*ask for --trials 2"):
        compared("se", runs=1, trials=1)
    assert table(out) == whole
    capsys.readouterr()
    compared("se", runs=1, trials=3)
    assert "runs of random in" in capsys.readouterr().err


def test_a_copy_among_the_records_is_no_run(tmp_path):
    (tmp_path / "runs").mkdir()
    append(RunKey("svae-dc", 3).path(tmp_path), trial(0))
    shutil.copy(RunKey("svae-dc", 3).path(tmp_path), tmp_path / "runs" / "svae-dc-00003 (copy).jsonl")
    assert ComparisonFolder(tmp_path).begun_keys() == [RunKey("svae-dc", 3)]
