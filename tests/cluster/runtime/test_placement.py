"""How processes share machines: by hand-made examples."""

import pytest

from cluster.config import TrainSettings
from cluster.errors import UsageError, UserError
from cluster.runtime.placement import FreeNode, Placement, place
from cluster.training.launch import placement_of


@pytest.mark.parametrize(
    ("machines", "processes", "cpus"),
    [
        ([8], 1, 8),
        ([8], 3, 2),
        ([8, 8], 1, 8),
        ([8, 8], 2, 8),
        ([8, 8], 3, 4),
        ([16, 4], 2, 8),
        ([16, 4], 4, 4),
        ([0, 5], 1, 5),
    ],
)
def test_all_is_the_most_that_every_process_finds_on_one_machine(machines, processes, cpus):
    assert place(processes, "all", [FreeNode(each) for each in machines]) == Placement(processes, cpus, 0)


def test_a_number_of_cpus_is_taken_as_it_is():
    assert place(2, 3, [FreeNode(8), FreeNode(8)]) == Placement(2, 3, 0)


def test_every_process_takes_a_gpu_where_there_are_any():
    machines = [FreeNode(8, gpus=1), FreeNode(32), FreeNode(4, gpus=1)]
    assert place(2, "all", machines) == Placement(2, 4, 1)


@pytest.mark.parametrize(
    ("processes", "cpus", "machines", "message"),
    [
        (1, 16, [FreeNode(8), FreeNode(8)], r"needs 16 CPUs .*one machine; free are 8 CPUs, 8 CPUs"),
        (2, "all", [FreeNode(1)], r"needs 2 CPUs .*free are 1 CPUs; lower train\.workers"),
        (3, "all", [FreeNode(8, gpus=2)], r"needs 3 CPUs and 3 GPUs .*free are 8 CPUs and 2 GPUs"),
        (1, "all", [], "free are none"),
    ],
)
def test_work_without_room_is_refused_instead_of_waiting_for_ever(processes, cpus, machines, message):
    with pytest.raises(UserError, match=message):
        place(processes, cpus, machines)


def test_a_gpu_is_left_alone_when_the_cpu_is_asked_for():
    machines = [FreeNode(8, gpus=1), FreeNode(8)]
    assert place(2, "all", machines, "cpu") == Placement(2, 8, 0)


def test_a_gpu_that_is_asked_for_and_absent_is_refused():
    with pytest.raises(
        UserError, match=r"train\.device=cuda asks for a GPU .* none free.*train\.device=auto"
    ):
        place(1, 1, [FreeNode(8)], "cuda")


def test_an_elastic_training_needs_room_only_for_its_least_processes():
    settings = TrainSettings(workers=8, least_workers=2, threads=3)
    assert placement_of(settings, [FreeNode(4), FreeNode(4)]) == Placement(8, 3, 0, least=2)
    with pytest.raises(UserError, match=r"needs 6 CPUs"):
        placement_of(settings, [FreeNode(4)])


def test_more_least_processes_than_processes_are_refused():
    with pytest.raises(UsageError, match=r"train\.least_workers must be at most train\.workers, got 3 of 2"):
        placement_of(TrainSettings(workers=2, least_workers=3), [FreeNode(8)])


@pytest.mark.parametrize(
    ("placement", "said"),
    [
        (Placement(1, 1, 0), "1 process of 1 CPU"),
        (Placement(4, 2, 1), "4 processes of 2 CPUs and a GPU"),
        (Placement(4, 2, 1, least=1), "4 processes (or as few as 1) of 2 CPUs and a GPU"),
    ],
)
def test_a_placement_says_what_it_is(placement, said):
    assert str(placement) == said
