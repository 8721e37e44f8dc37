"""What a training refuses before it starts, with the reason and the remedy."""

import shutil

import numpy as np
import pytest

from cluster.errors import UsageError, UserError
from cluster.tracking import open_tracker


def test_a_gpu_that_nobody_has_is_refused_before_anything_is_decoded_or_tracked(
    run_train, tracking_settings, tmp_path
):
    with pytest.raises(UserError, match=r"train\.device=cuda asks for a GPU and Ray finds none"):
        run_train(device="cuda", cache=tmp_path / "cache")
    assert not (tmp_path / "cache").exists()
    assert open_tracker(tracking_settings).client.search_runs(["1"]) == []


def test_a_model_that_is_a_file_is_refused(run_train, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    for name in ("file", "file/below"):
        with pytest.raises(UsageError, match=r"--model takes a folder, .*file.* is a file"):
            run_train(name)


def test_numbers_that_are_not_finite_are_refused_by_episode(run_train, franka_dataset, tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    broken = tmp_path / "broken"
    shutil.copytree(franka_dataset, broken)
    victim = sorted(broken.glob("*.parquet"))[1]
    table = pq.read_table(victim)
    f = table.column("f").to_numpy().copy()
    f[3] = np.nan
    index = table.schema.get_field_index("f")
    pq.write_table(table.set_column(index, table.schema.field(index), pa.array(f)), victim)
    with pytest.raises(UserError, match=rf"{victim.name} holds NaN or infinity in f of episode 43"):
        run_train(folder=broken, cache=tmp_path / "cache")


def test_names_and_folders_that_do_not_exist_are_refused(run_train, tmp_path):
    with pytest.raises(UsageError, match="did you mean 'compact'"):
        run_train(preset="compcat")
    with pytest.raises(UserError, match="holds no dataset"):
        run_train(folder=tmp_path / "nowhere")


@pytest.mark.slow
def test_too_few_episodes_are_refused_with_the_number_needed(run_train, small_dataset):
    with pytest.raises(UserError, match="holds 16 episodes, training needs at least 200"):
        run_train(folder=small_dataset)


@pytest.mark.slow
def test_more_processes_than_cpus_are_refused_instead_of_hanging(run_train):
    with pytest.raises(UserError, match="needs 8 CPUs"):
        run_train(workers=2, threads=4)


@pytest.mark.slow
def test_a_corrupt_shard_ends_training_before_it_starts(run_train, franka_dataset, tmp_path):
    broken = tmp_path / "broken"
    broken.mkdir()
    for path in franka_dataset.iterdir():
        if path.is_file():
            (broken / path.name).write_bytes(path.read_bytes())
    victim = sorted(broken.glob("*.parquet"))[1]
    victim.write_bytes(victim.read_bytes()[:1000])
    with pytest.raises(UserError, match=victim.name):
        run_train(folder=broken, cache=tmp_path / "cache")
