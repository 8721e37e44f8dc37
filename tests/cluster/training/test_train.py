"""`svaedc train` on a real cluster, with a dataset small enough for seconds."""

import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from cluster.config import TrackingSettings, TrainSettings
from cluster.errors import UsageError, UserError
from cluster.tracking import open_tracker
from cluster.training.record import judge
from cluster.training.train import train, working_in
from svaedc.model import checkpoint


def settings(cache: Path, **changes) -> TrainSettings:
    return TrainSettings(
        **{"updates": 40, "epoch_updates": 20, "threads": 1, "moments": 0, "cache_folder": cache, **changes}
    )


@pytest.fixture(scope="module")
def cache(tmp_path_factory) -> Path:
    """One for all tests: the dataset is decoded once."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def run_train(ray_session, tracking_settings, franka_dataset, tmp_path, cache):
    """Trains into a folder of the test's own."""

    def run(name: str = "model", preset: str = "compact", folder: Path = franka_dataset, **changes) -> Path:
        return train(
            folder=folder,
            model=tmp_path / name,
            preset=preset,
            seed=0,
            settings=settings(changes.pop("cache", cache), **changes),
            session=ray_session,
            tracker=open_tracker(tracking_settings),
        )

    return run


@pytest.fixture(scope="module")
def ends(ray_session, franka_dataset, tmp_path_factory, cache) -> dict[str, Path]:
    """Folders of a finished training and of one that its time limit ended half-way."""
    folder = tmp_path_factory.mktemp("ends")
    limits = {"finished": float("inf"), "half-way": 1e-6}
    for name, limit in limits.items():
        train(
            folder=franka_dataset,
            model=folder / name,
            preset="compact",
            seed=0,
            settings=settings(cache, time_limit_seconds=limit),
            session=ray_session,
            tracker=open_tracker(TrackingSettings(uri=f"sqlite:///{folder}/mlflow.db")),
        )
    return {name: folder / name for name in limits}


@pytest.fixture
def finished(ends, tmp_path) -> Path:
    """The checkpoint of a finished training, in the folder that `run_train` uses."""
    return shutil.copytree(ends["finished"], tmp_path / "model") / "model.pt"


@pytest.fixture
def half_way(ends, tmp_path) -> Path:
    """The checkpoint of a training that goes on, in the folder that `run_train` uses."""
    return shutil.copytree(ends["half-way"], tmp_path / "model") / "model.pt"


def weights(path: Path) -> dict[str, torch.Tensor]:
    return checkpoint.load(path)[0].state_dict()


def same(first: dict[str, torch.Tensor], second: dict[str, torch.Tensor]) -> bool:
    return first.keys() == second.keys() and all(torch.equal(first[name], second[name]) for name in first)


def test_training_leaves_a_model_its_measures_a_picture_and_a_tracked_run(
    run_train, tracking_settings, capsys
):
    before = signal.getsignal(signal.SIGINT)
    path = run_train(moments=1)
    assert signal.getsignal(signal.SIGINT) is before
    model, metadata = checkpoint.load(path)
    assert metadata["setup"] == "franka"
    assert metadata["update"] == 40
    assert model.latent_means(torch.rand(3, 48))[0].shape == (3, 9)
    measured = json.loads((path.parent / "metrics.json").read_text())
    assert {"rec_norm", "gen_norm", "corr_y_rec", "active_dimensions"} <= measured["metrics"].keys()
    assert (path.parent / "reconstruction.png").stat().st_size > 10_000
    client = open_tracker(tracking_settings).client
    [run] = client.search_runs(["1"])
    steps = [point.step for point in client.get_metric_history(run.info.run_id, "held_out/gen_norm")]
    assert steps == [20, 40]
    assert run.inputs.dataset_inputs[0].dataset.name == "franka"
    assert {artifact.path for artifact in client.list_artifacts(run.info.run_id)} >= {"figures", "model.pt"}
    figures = {artifact.path for artifact in client.list_artifacts(run.info.run_id, "figures")}
    assert figures >= {"figures/motions.gif", "figures/motions.png"}
    assert run.data.tags["svaedc.device"] == "cpu (1 threads), float32"
    while_it_trains = ("log_p_xi", "log_p_y", "log_p_latent", "minus_log_q", "mae_y_gen", "latent_spread/08")
    assert {f"held_out/{name}" for name in while_it_trains} <= run.data.metrics.keys()
    assert run.data.metrics["train/trajectories_per_second"] > 0.0
    assert run.data.metrics["train/learning_rate"] > 0.0
    assert (run.data.params["stride"], run.data.params["updates"]) == ("5", "40")
    capsys.readouterr()
    assert run_train() == path
    assert "nothing to do" in capsys.readouterr().err
    assert sorted(file.name for file in path.parent.iterdir()) == [
        "badness.png",
        "latent-space.png",
        "metrics.json",
        "model.pt",
        "motions.gif",
        "motions.png",
        "reconstruction.png",
        "run.json",
        "training.pt",
    ]


@pytest.mark.slow
def test_two_processes_learn_what_one_does(run_train):
    measured = [
        json.loads((run_train(f"{count}", workers=count).parent / "metrics.json").read_text())["metrics"]
        for count in (1, 2)
    ]
    assert measured[0]["rec_norm"] == pytest.approx(measured[1]["rec_norm"], rel=0.1)


@pytest.mark.slow
def test_training_stops_at_its_time_limit_and_goes_on_from_there(run_train, half_way, ends):
    assert checkpoint.load(half_way)[1]["update"] == 20
    path = run_train()
    assert checkpoint.load(path)[1]["update"] == 40
    assert json.loads(path.with_name("metrics.json").read_text())["update"] == 40
    assert same(weights(path), weights(ends["finished"] / "model.pt"))


def test_the_model_in_mlflow_answers_in_a_fresh_process_without_the_package(
    run_train, finished, tracking_settings, tmp_path
):
    finished.with_name("metrics.json").unlink()
    run_train()
    [model] = open_tracker(tracking_settings).client.search_logged_models(["1"])
    x = np.random.default_rng(0).random((3, 48), dtype=np.float32)
    np.save(tmp_path / "x.npy", x)
    script = f"""
import mlflow, numpy, sys
mlflow.set_tracking_uri({tracking_settings.uri!r})
answer = mlflow.pyfunc.load_model("models:/{model.model_id}").predict(numpy.load("x.npy"))
import svaedc
assert "mlruns" in svaedc.__file__, svaedc.__file__
numpy.savez("answer.npz", **answer)
"""
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, capture_output=True)
    answer = np.load(tmp_path / "answer.npz")
    tau, y = checkpoint.load(finished)[0].latent_means(torch.from_numpy(x))
    np.testing.assert_allclose(answer["tau"], tau.detach(), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(answer["y"], y.detach(), rtol=1e-5)


@pytest.mark.slow
def test_the_choices_of_a_preset_can_be_changed_and_belong_to_the_model_s_origin(run_train):
    path = run_train(model="svae", distribution="gaussian", latent="5x6", balance="f", updates=3)
    model, metadata = checkpoint.load(path)
    assert (model.config.psi_dim, model.config.distribution, model.config.tau_size) == (0, "gaussian", 30)
    assert model.config.channels == (64, 128, 256)
    assert metadata["balance"] == "f"
    assert metadata["changes"].items() >= {"model": "svae", "latent": "5x6"}.items()
    assert not (path.parent / "badness.png").exists()
    with pytest.raises(UserError, match="was made for balance 'f', not 'none'"):
        run_train(updates=3)


def test_a_gpu_that_nobody_has_is_refused_before_anything_is_decoded_or_tracked(
    run_train, tracking_settings, tmp_path
):
    with pytest.raises(UserError, match=r"train\.device=cuda asks for a GPU and Ray finds none"):
        run_train(device="cuda", cache=tmp_path / "cache")
    assert not (tmp_path / "cache").exists()
    assert open_tracker(tracking_settings).client.search_runs(["1"]) == []


def test_a_training_that_has_no_room_to_go_on_is_tracked_by_no_new_run(
    run_train, half_way, tracking_settings
):
    with pytest.raises(UserError, match="needs 8 CPUs"):
        run_train(workers=2, threads=4)
    assert half_way.exists()
    assert open_tracker(tracking_settings).client.search_runs(["1"]) == []


def test_two_trainings_at_once_in_one_folder_are_refused(run_train, finished):
    with (
        working_in(finished.parent),
        pytest.raises(UserError, match=r"another training is at work in .*/model; wait for its end"),
    ):
        run_train()
    assert run_train() == finished


@pytest.mark.slow
def test_an_elastic_training_starts_with_the_processes_there_is_room_for(run_train, capsys):
    path = run_train(workers=64, least_workers=1)
    assert checkpoint.load(path)[1]["update"] == 40
    assert "64 processes (or as few as 1)" in capsys.readouterr().err


def test_a_model_that_is_not_finished_says_that_the_command_goes_on(capsys):
    judge({"collapsed": "", "episodes": 240, "update": 40}, updates=80)
    assert "after 40 of 80 updates; the same command goes on" in capsys.readouterr().err


@pytest.mark.slow
def test_a_training_that_died_before_its_last_file_still_leaves_a_model(run_train, finished):
    before = weights(finished)
    finished.unlink()
    assert same(before, weights(run_train()))


def test_a_training_that_died_before_its_last_record_only_repeats_the_record(run_train, finished, capsys):
    measures = finished.with_name("metrics.json")
    written, trained_at = measures.read_text(), finished.stat().st_mtime_ns
    measures.unlink()
    run_train()
    assert measures.read_text() == written
    assert finished.stat().st_mtime_ns == trained_at
    assert "held-out error" in capsys.readouterr().err


def test_a_full_disk_while_recording_is_named_and_loses_nothing(run_train, finished):
    finished.with_name("metrics.json").unlink()
    finished.with_name(".unfinished-metrics.json").symlink_to("/dev/full")
    with pytest.raises(UserError, match=r"No space left on device.*run the same command"):
        run_train()
    assert finished.exists()
    assert run_train().with_name("metrics.json").exists()


def test_a_collapsed_model_of_a_full_size_dataset_is_refused_every_time(run_train, finished):
    measures = finished.with_name("metrics.json")
    summary = json.loads(measures.read_text())
    measures.write_text(json.dumps({**summary, "collapsed": "the model collapsed: x", "episodes": 10_000}))
    for _ in range(2):
        with pytest.raises(UserError, match=r"the model collapsed: x\. The checkpoint is kept"):
            run_train()


def test_a_collapsed_model_of_a_small_dataset_is_only_a_note(capsys):
    judge({"collapsed": "the model collapsed: x", "episodes": 9_999, "update": 80}, updates=80)
    assert "with only 9999 episodes: the model collapsed: x" in capsys.readouterr().err


def test_other_updates_than_the_training_began_with_are_refused_naming_both(run_train, half_way):
    assert half_way.exists()
    with pytest.raises(UserError, match=r"joint\.updates was 40, is 50; .* another --model folder"):
        run_train(updates=50)


def test_a_finished_model_is_not_trained_over(run_train, finished):
    finished.with_name("training.pt").unlink()
    assert run_train() == finished
    with pytest.raises(UserError, match="trained for 40 updates, not 50"):
        run_train(updates=50)


@pytest.mark.slow
def test_training_goes_on_in_another_tracking_store_as_a_new_run(run_train, half_way, tracking_settings):
    before = json.loads(half_way.with_name("run.json").read_text())["run"]
    path = run_train()
    [run] = open_tracker(tracking_settings).client.search_runs(["1"])
    assert run.info.run_id == json.loads(path.with_name("run.json").read_text())["run"] != before
    assert checkpoint.load(path)[1]["update"] == 40


@pytest.mark.slow
def test_a_relative_cache_folder_is_the_driver_s(run_train, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    run_train(cache=Path("near"))
    assert len(list((tmp_path / "near").glob("*-stride5"))) == 1


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


def test_too_few_episodes_are_refused_with_the_number_needed(run_train, small_dataset):
    with pytest.raises(UserError, match="holds 16 episodes, training needs at least 200"):
        run_train(folder=small_dataset)


def test_more_processes_than_cpus_are_refused_instead_of_hanging(run_train):
    with pytest.raises(UserError, match="needs 8 CPUs"):
        run_train(workers=2, threads=4)


def test_a_folder_with_a_model_of_another_origin_is_refused(run_train, finished):
    with pytest.raises(UserError, match="made for stride 5, not 10"):
        run_train(stride=10)
    assert finished.exists()


def test_a_damaged_checkpoint_is_named(run_train, finished):
    finished.unlink()
    finished.with_name("training.pt").write_bytes(b"half a file")
    with pytest.raises(UserError, match=r"training\.pt is damaged"):
        run_train()


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
