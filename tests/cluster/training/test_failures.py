"""Which failures of training processes another try survives, and what is said of the others."""

import errno
import os
import re
import signal
from pathlib import Path

import pytest
import torch
from ray.exceptions import ActorDiedError
from ray.train import ControllerError, RunConfig, ScalingConfig, TrainingFailedError, WorkerGroupError
from ray.train.torch import TorchTrainer
from ray.train.v2._internal.exceptions import (
    WorkerGroupStartupTimeoutError,
    WorkerHealthCheckFailedError,
    WorkerHealthCheckTimeoutError,
)

from cluster.training.failures import explanation, is_death
from cluster.training.launch import keep_interrupts

KILLED = WorkerHealthCheckFailedError("A worker health check failed.\nWorker info: ...", ActorDiedError())
# As torch 2.13 words it in one process when the other is killed.
ABANDONED = RuntimeError(
    "[/pytorch/third_party/gloo/gloo/transport/tcp/pair.cc:537] Read error [127.0.0.1]:21402: Connection "
    "reset by peer. This is typically caused by a remote worker hanging or bugs in the application."
)


def ended(*failures: Exception) -> WorkerGroupError:
    """An error of Ray Train whose processes ended so, in the order of their ranks."""
    return WorkerGroupError("", dict(enumerate(failures)))


@pytest.mark.parametrize(
    "failures",
    [
        (KILLED,),
        (WorkerHealthCheckTimeoutError("A worker health check has been hanging"),),
        (ABANDONED, KILLED),
        (ABANDONED,),
        (RuntimeError("an error of torch that names no transport"), KILLED),
        (ConnectionResetError(errno.ECONNRESET, "Connection reset by peer"), KILLED),
        (torch.distributed.DistNetworkError("the store is gone"), KILLED),
    ],
)
def test_a_lost_process_and_what_it_does_to_the_others_is_a_death(failures):
    assert is_death(ended(*failures))


@pytest.mark.parametrize(
    ("failures", "said"),
    [
        ((torch.OutOfMemoryError("CUDA out of memory.\nTry less."),), "OutOfMemoryError: CUDA out of memory"),
        ((ABANDONED, torch.OutOfMemoryError("CUDA out of memory.")), "OutOfMemoryError: CUDA out of memory"),
        ((RuntimeError("mat1 and mat2 shapes cannot be multiplied"),), "RuntimeError: mat1 and mat2 shapes"),
        ((TypeError("unsupported operand"),), "TypeError: unsupported operand"),
        ((AssertionError(),), "training failed: AssertionError$"),
        ((KeyError("prior"),), "KeyError: 'prior'"),
        ((ValueError("data/franka has changed"),), "training failed: data/franka has changed$"),
        ((OSError(errno.ENOSPC, "No space left"), KILLED), "No space left; free some space"),
    ],
)
def test_an_error_of_the_training_itself_is_no_death_and_is_told_with_its_kind(failures, said):
    error = ended(*failures)
    assert not is_death(error)
    assert re.search(said, explanation(error, Path("model")))


def test_a_process_lost_while_the_controller_asks_it_is_a_death_and_a_group_without_room_is_none(tmp_path):
    lost = ControllerError(ActorDiedError())
    assert is_death(lost)
    assert "keep dying, one of them with ActorDiedError" in explanation(lost, tmp_path)
    crowded = ControllerError(WorkerGroupStartupTimeoutError(num_workers=2))
    assert not is_death(crowded)
    assert explanation(crowded, tmp_path).startswith("the training processes could not start: ")


def test_processes_that_keep_dying_are_told_as_that():
    said = explanation(ended(ABANDONED, KILLED), Path("model"))
    assert "keep dying, one of them with ActorDiedError" in said
    assert said.endswith("goes on from the last checkpoint in model")


@pytest.mark.slow
@pytest.mark.usefixtures("ray_session")
@pytest.mark.parametrize("dies", [True, False])
def test_ray_train_tells_a_killed_process_of_a_group_from_one_with_an_error(tmp_path, dies):
    def exchange(config):
        import ray.train

        rank = ray.train.get_context().get_world_rank()
        for count in range(1000):
            if rank == 1 and count == 10:
                if config["dies"]:
                    os.kill(os.getpid(), signal.SIGKILL)
                raise torch.OutOfMemoryError("out of memory")
            torch.distributed.all_reduce(torch.ones(1))

    trainer = TorchTrainer(
        exchange,
        train_loop_config={"dies": dies},
        scaling_config=ScalingConfig(num_workers=2, resources_per_worker={"CPU": 1}),
        run_config=RunConfig(storage_path=str(tmp_path)),
    )
    with keep_interrupts(), pytest.raises(TrainingFailedError) as raised:
        trainer.fit()
    assert is_death(raised.value) == dies
    assert ("keep dying" in explanation(raised.value, tmp_path)) == dies
