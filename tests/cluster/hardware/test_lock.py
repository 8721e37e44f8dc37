"""The lock of a campaign's folder."""

from dataclasses import replace

import pytest

from cluster.hardware import lock
from cluster.hardware.lock import FolderLock, FolderTaken, Process


def hold(folder, held, let_go):
    with FolderLock(folder, 0.0):
        held.set()
        let_go.wait()


def test_the_lock_names_the_process_that_holds_it_and_dies_with_it(processes, tmp_path):
    held, let_go = processes.Event(), processes.Event()
    process = processes.Process(target=hold, args=(tmp_path, held, let_go))
    process.start()
    assert held.wait(timeout=180)
    assert lock.holder(tmp_path) == replace(Process.current(), pid=process.pid)
    with pytest.raises(FolderTaken, match=f"process {process.pid}"):
        FolderLock(tmp_path, 0.2)
    process.kill()
    process.join()
    with FolderLock(tmp_path, 5.0):
        assert lock.holder(tmp_path) == Process.current()
    assert lock.holder(tmp_path) is None
