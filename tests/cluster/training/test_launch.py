"""A job in the hands of Ray Train: its processes agree, and what ends it is told at once."""

import signal
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from ray.train import RunConfig, ScalingConfig
from ray.train.torch import TorchTrainer

from cluster.errors import UserError
from cluster.progress import ProgressLine
from cluster.runtime.mailbox import mailbox
from cluster.runtime.placement import Placement
from cluster.runtime.signals import terminating_as_exit
from cluster.tracking import open_tracker
from cluster.training.launch import keep_interrupts, submit
from cluster.training.worker import TrainingJob, train_together
from svaedc.model import checkpoint
from workers.dataset.folder import open_dataset


@pytest.fixture
def job(franka_dataset, tmp_path) -> TrainingJob:
    """A job as `train` plans it."""
    (tmp_path / "model").mkdir()
    return TrainingJob(
        dataset=franka_dataset.resolve(),
        model=tmp_path / "model",
        cache=tmp_path / "cache",
        origin={
            "setup": "franka",
            "dataset": open_dataset(franka_dataset).fingerprint(),
            "preset": "compact",
            "stride": 5,
            "seed": 0,
            "balance": "none",
            "changes": {},
        },
        preset="compact",
        updates=40,
        stride=5,
        seed=0,
        time_limit=float("inf"),
        checkpoint_every=1,
    )


@pytest.mark.slow
@pytest.mark.usefixtures("ray_session")
def test_two_processes_train_one_model(job, tmp_path):
    def save_copy(config):
        import ray.train

        model = train_together(config["job"], config["mailbox"].actor.put_nowait.remote)
        torch.save(model.state_dict(), config["folder"] / f"{ray.train.get_context().get_world_rank()}.pt")

    with mailbox([].append) as box:
        trainer = TorchTrainer(
            save_copy,
            train_loop_config={"job": job, "mailbox": box, "folder": tmp_path},
            scaling_config=ScalingConfig(num_workers=2, resources_per_worker={"CPU": 1}),
            run_config=RunConfig(storage_path=str(tmp_path / "ray")),
        )
        with keep_interrupts():
            trainer.fit()
    one, other = (torch.load(tmp_path / f"{rank}.pt", weights_only=True) for rank in range(2))
    saved = checkpoint.load(job.model / "model.pt")[0].state_dict()
    for name, value in saved.items():
        assert torch.equal(one[name], value)
        assert torch.equal(other[name], value)


@pytest.mark.slow
@pytest.mark.usefixtures("ray_session")
def test_a_dataset_that_grew_since_the_plan_ends_training_at_the_first_try(tracking_settings, job, capsys):
    planned = replace(job, origin={**job.origin, "dataset": "0" * 64})
    with (
        open_tracker(tracking_settings).run("train", "train", {}) as run,
        ProgressLine("updates", 40, 0) as progress,
        pytest.raises(UserError, match=r"has changed since this training was planned: .* was 000000000000"),
    ):
        submit(planned, Placement(1, 1, 0), progress, run)
    assert "going on" not in capsys.readouterr().err


def test_a_job_takes_no_relative_paths(job):
    with pytest.raises(ValueError, match=r"cache must be an absolute path, got near"):
        replace(job, cache=Path("near"))


def test_ctrl_c_and_sigterm_keep_their_meaning_whatever_ray_makes_of_them():
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]

    def leave(number: int) -> None:
        with terminating_as_exit(), keep_interrupts():
            # Ray Train's handler, and what `ray.get` makes of every exit.
            signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
            try:
                signal.raise_signal(number)
            except SystemExit:
                sys.exit(1)

    with pytest.raises(KeyboardInterrupt):
        leave(signal.SIGINT)
    with pytest.raises(SystemExit, match="143"):
        leave(signal.SIGTERM)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers
