"""Processes at work in a dataset see each other, and nobody sees the dead."""

import subprocess
import sys

from workers.dataset.storage.presence import others_at_work, presence

WAIT = (
    "import sys\nfrom pathlib import Path\nfrom workers.dataset.storage.presence import presence\n"
    "with presence(Path(sys.argv[1])):\n    print('there', flush=True)\n    sys.stdin.read()\n"
)


def test_another_process_is_seen_while_it_lives_and_oneself_never(tmp_path):
    assert others_at_work(tmp_path) == []
    with presence(tmp_path):
        assert others_at_work(tmp_path) == []
        process = subprocess.Popen(
            [sys.executable, "-c", WAIT, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert process.stdout.readline() == b"there\n"
        (other,) = others_at_work(tmp_path)
        process.kill()
        process.wait()
        assert other.exists()
        assert others_at_work(tmp_path) == []
        process.stdin.close()
        process.stdout.close()


def test_nothing_is_left_at_the_end(tmp_path):
    with presence(tmp_path):
        pass
    assert list((tmp_path / ".writing").iterdir()) == []
