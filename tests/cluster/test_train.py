"""`svaedc train` on a real cluster, with a dataset small enough for seconds."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import torch

from cluster.config import TrainSettings
from cluster.errors import UsageError, UserError
from cluster.tracking import open_tracker
from cluster.train import train
from svaedc import checkpoint


def settings(cache: Path, **changes) -> TrainSettings:
    return TrainSettings(**{"updates": 40, "threads": 1, "cache_folder": cache, **changes})


@pytest.fixture
def trained(ray_session, tracking_settings, franka_dataset, tmp_path):
    """Trains into a folder of the test's own."""

    def run(name: str = "model", preset: str = "compact", folder: Path = franka_dataset, **changes) -> Path:
        return train(
            folder=folder,
            model=tmp_path / name,
            preset=preset,
            seed=0,
            settings=settings(tmp_path / "cache", **changes),
            session=ray_session,
            tracker=open_tracker(tracking_settings),
        )

    return run


def test_training_leaves_a_model_its_measures_a_picture_and_a_tracked_run(trained, tracking_settings, capsys):
    path = trained()
    model, metadata = checkpoint.load(path)
    assert metadata["setup"] == "franka"
    assert metadata["update"] == 80
    assert model.latent_means(torch.rand(3, 48))[0].shape == (3, 9)
    measured = json.loads((path.parent / "metrics.json").read_text())
    assert {"rec_norm", "gen_norm", "corr_y_rec", "active_dimensions"} <= measured["metrics"].keys()
    assert (path.parent / "reconstruction.png").stat().st_size > 10_000
    client = open_tracker(tracking_settings).client
    [run] = client.search_runs(["1"])
    steps = [point.step for point in client.get_metric_history(run.info.run_id, "held_out/gen_norm")]
    assert steps == [40, 80]
    assert run.inputs.dataset_inputs[0].dataset.name == "franka"
    assert {artifact.path for artifact in client.list_artifacts(run.info.run_id)} >= {"figures", "model.pt"}
    capsys.readouterr()
    assert trained() == path
    assert "nothing to do" in capsys.readouterr().err


def test_two_processes_train_one_model(trained):
    path = trained(workers=2)
    assert checkpoint.load(path)[1]["update"] == 80


def test_training_stops_at_its_time_limit_and_goes_on_from_there(trained, capsys):
    path = trained(time_limit_seconds=1e-6)
    assert checkpoint.load(path)[1]["update"] == 40
    assert "the same command goes on" in capsys.readouterr().err
    assert checkpoint.load(trained())[1]["update"] == 80


def test_a_training_that_died_before_its_last_file_still_leaves_a_model(trained):
    path = trained()
    before = checkpoint.load(path)[0].state_dict()
    path.unlink()
    after = checkpoint.load(trained())[0].state_dict()
    assert all(torch.equal(before[name], after[name]) for name in before)


def test_names_and_folders_that_do_not_exist_are_refused(trained, tmp_path):
    with pytest.raises(UsageError, match="did you mean 'compact'"):
        trained(preset="compcat")
    with pytest.raises(UserError, match="holds no dataset"):
        trained(folder=tmp_path / "nowhere")


def test_too_few_episodes_are_refused_with_the_number_needed(trained, small_dataset):
    with pytest.raises(UserError, match="holds 16 episodes, training needs at least 200"):
        trained(folder=small_dataset)


def test_more_processes_than_cpus_are_refused_instead_of_hanging(trained):
    with pytest.raises(UserError, match="needs 8 CPUs"):
        trained(workers=2, threads=4)


def test_a_folder_with_a_model_of_another_origin_is_refused(trained):
    trained()
    with pytest.raises(UserError, match="made for stride 5, not 10"):
        trained(stride=10)


def test_a_damaged_checkpoint_is_named(trained):
    path = trained()
    path.unlink()
    (path.parent / "training.pt").write_bytes(b"half a file")
    with pytest.raises(UserError, match=r"training\.pt is damaged"):
        trained()


def test_a_corrupt_shard_ends_training_before_it_starts(trained, franka_dataset, tmp_path):
    broken = tmp_path / "broken"
    broken.mkdir()
    for path in franka_dataset.iterdir():
        if path.is_file():
            (broken / path.name).write_bytes(path.read_bytes())
    victim = sorted(broken.glob("*.parquet"))[1]
    victim.write_bytes(victim.read_bytes()[:1000])
    with pytest.raises(UserError, match=victim.name):
        trained(folder=broken)


def command(dataset: Path, model: Path, root: Path) -> list[str]:
    return [
        *(sys.executable, "-m", "cluster", "train", "--dataset", str(dataset), "--model", str(model)),
        *("--set", "train.updates=500", "--set", "train.threads=1"),
        *(
            "--set",
            f"train.cache_folder={root / 'cache'}",
            "--set",
            f"tracking.uri=sqlite:///{root / 'mlflow.db'}",
        ),
    ]


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 240
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return checkpoint.load(folder / "model.pt")[0].state_dict()


@pytest.mark.slow
def test_killing_the_training_process_or_the_driver_changes_nothing(franka_dataset, tmp_path):
    undisturbed = command(franka_dataset, tmp_path / "undisturbed", tmp_path)
    subprocess.run(undisturbed, check=True, capture_output=True)
    for victim in ("worker", "driver"):
        line = command(franka_dataset, tmp_path / victim, tmp_path)
        with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
            wait_for(tmp_path / victim / "training.pt", process)
            if victim == "driver":
                process.kill()
            else:
                children = psutil.Process(process.pid).children(recursive=True)
                [rank] = [child for child in children if "RayTrainWorker" in " ".join(child.cmdline())]
                os.kill(rank.pid, signal.SIGKILL)
            process.communicate(timeout=400)
        if victim == "driver":
            subprocess.run(line, check=True, capture_output=True)
        expected, found = weights(tmp_path / "undisturbed"), weights(tmp_path / victim)
        assert all(torch.equal(expected[name], found[name]) for name in expected), victim
