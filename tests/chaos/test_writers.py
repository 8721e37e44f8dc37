"""Rollout processes without Ray around them, killed within a fraction of a second, often amid a file."""

import multiprocessing

import pytest

from tests.chaos.drivers import (
    Blows,
    begun,
    collect_and_clean,
    collected_here,
    published,
    require_part,
    require_same,
    seed,
)

KILLS, EPISODES = 300, 400
LIFE_SECONDS = 0.25
"""A life ends within this time, or a longer one while the machine is so busy that nothing gets done."""


@pytest.fixture(scope="module")
def context():
    """Processes that start in milliseconds: forked from a server that has imported everything."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.chaos.drivers"])
    return context


@pytest.mark.chaos
def test_no_kill_of_writers_changes_a_byte_whatever_they_were_writing(tmp_path, context):
    """Two at a time on one dataset, each of which sweeps and goes on where the killed ones were."""
    undisturbed = published(collected_here(tmp_path / "undisturbed", EPISODES).folder)
    blows, finished, unfinished, longest = Blows(tmp_path, seed()), 0, None, LIFE_SECONDS
    print(f"CHAOS_SEED={blows.seed}")
    while blows.dealt.total() < KILLS or not finished:
        folder = tmp_path / f"dataset-{finished}"
        unfinished = unfinished or begun(folder)
        before = len(published(folder))
        pair = [context.Process(target=collect_and_clean, args=(folder, EPISODES)) for _ in range(2)]
        for process in pair:
            process.start()
        for process in pair:
            process.join(blows.rng.uniform(0.0, longest))
            blows.writer(process)
        require_part(folder, undisturbed)
        longest = LIFE_SECONDS if len(published(folder)) > before else 1.5 * longest
        if len(published(folder)) == len(undisturbed):
            collect_and_clean(folder, EPISODES)
            require_same(folder, undisturbed, [unfinished])
            unfinished, finished = None, finished + 1
    print(f"{blows}; {finished} collections finished")
    assert blows.unfinished > 0
