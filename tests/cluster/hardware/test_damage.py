"""Journals that a broken disk, a bad copy or an editor changed: refused in words, or read as they were."""

import errno
import os
import random
import shutil
from contextlib import closing
from dataclasses import replace

import pytest

from cluster.errors import UserError
from cluster.hardware import journal, operator
from cluster.hardware.database import JournalError
from cluster.hardware.executor import Executor
from cluster.hardware.states import Approval, State
from tests.cluster.hardware.desk import carry_out, opened
from tests.cluster.hardware.rehearsals import carried_out, plan_in


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    carry_out(folder)
    with closing(opened(folder)) as book:
        return (folder / journal.FILE).read_bytes(), book.events(), book.trials()


def damaged(content, rng):
    """One to three changes, as disks and editors make them."""
    content = bytearray(content)
    for _ in range(rng.randint(1, 3)):
        place = rng.randrange(len(content))
        kind = rng.randrange(5)
        if kind == 0:
            content[place] ^= 1 << rng.randrange(8)
        elif kind == 1:
            content[place : place + 16] = rng.randbytes(16)
        elif kind == 2:
            content[place : place + 512] = bytes(512)
        elif kind == 3:
            del content[place:]
            content = content or bytearray(b"x")
        else:
            content[place:place] = rng.randbytes(rng.randint(1, 40))
    return bytes(content)


@pytest.mark.parametrize("times", [150, pytest.param(10_000, marks=pytest.mark.slow)])
def test_a_damaged_journal_is_refused_in_words_or_read_as_it_was(whole, tmp_path, times):
    content, events, trials = whole
    rng, refused = random.Random(times), []
    for number in range(times):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / journal.FILE).write_bytes(damaged(content, rng))
        try:
            with closing(opened(folder)) as book:
                assert (book.events(), book.trials()) == (events, trials)
        except JournalError as error:
            refused.append(str(error))
        shutil.rmtree(folder)
    assert len(refused) > times / 2
    assert all(journal.FILE in told or "no campaign" in told for told in refused)


@pytest.fixture
def broken_disk(monkeypatch):
    """(errno) -> from now on no byte is made durable, as on a disk that dies."""

    def breaks(number):
        def fsync(_):
            raise OSError(number, os.strerror(number))

        monkeypatch.setattr(os, "fsync", fsync)

    return breaks


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC])
def test_a_disk_that_dies_lets_nothing_move_and_is_named(tmp_path, broken_disk, number):
    plan = plan_in(tmp_path / "campaign", trials=0, approval=Approval.OPERATOR)
    plan = replace(plan, home=tmp_path / "home")  # the usual one knows what other tests have moved
    carried_out(plan)
    operator.approve(plan.folder, 0, "Ada")
    executor = Executor(plan)
    home = executor._home
    broken_disk(number)
    with pytest.raises(UserError, match=f"{os.strerror(number)}.*nothing is moved without it"):
        executor.advance()
    assert not any(entry.event == "started" for entry in home.ledger.entries())
    assert operator.status(plan.folder).trials[0].state in (State.APPROVED, State.GRANTED)
    executor.close()


def test_a_disk_that_works_again_lets_the_same_command_go_on(tmp_path, broken_disk, monkeypatch):
    plan = plan_in(tmp_path / "campaign", trials=0)
    broken_disk(errno.EIO)
    with pytest.raises(UserError):
        carried_out(plan)
    monkeypatch.undo()
    assert [trial.state for trial in carried_out(plan).trials] == [State.MEASURED] * 2
