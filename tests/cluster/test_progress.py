"""Progress on a terminal of any width and in a log."""

import os
import pty
import re
import subprocess
import sys
import time
from fcntl import ioctl
from struct import pack
from termios import TIOCSWINSZ

import pytest

from cluster import progress
from cluster.progress import ProgressLine, say

WORK = """
from cluster.progress import ProgressLine
with ProgressLine("episodes", 1200, 0) as line:
    for _ in range(4):
        line.advance(300, "bad 0.53, one-machine 10.2/s, another-machine 14.4/s")
"""


@pytest.fixture
def at_once(monkeypatch):
    """A line of a log at every advance."""
    monkeypatch.setattr(progress, "_LOG_SECONDS", -1.0)


@pytest.mark.usefixtures("at_once")
def test_a_log_says_share_rate_and_time_left_and_at_the_end_the_time_it_took(capsys):
    with ProgressLine("episodes", 300, 100) as line:
        time.sleep(0.01)
        line.advance(100, "bad 0.53")
        line.advance(100, "")
    first, second, last = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"200/300 episodes \(66 %\), [\d.]+/s, 0 s left, bad 0.53", first)
    assert re.fullmatch(r"300/300 episodes \(100 %\), [\d.]+/s, 0 s left", second)
    assert re.fullmatch(r"300/300 episodes \(100 %\), [\d.]+/s, in 0 s", last)


def test_work_of_a_moment_leaves_one_line_in_a_log(capsys):
    with ProgressLine("pictures", 3, 0) as line:
        for _ in range(3):
            line.advance(1, "")
    assert capsys.readouterr().err.startswith("3/3 pictures (100 %), ")


def test_work_that_fails_or_was_done_before_has_no_last_line(capsys):
    line = ProgressLine("pictures", 3, 0)
    with pytest.raises(ValueError, match="why"), line:
        raise ValueError(f"why {line.advance(1, '')}")
    with ProgressLine("pictures", 3, 3):
        pass
    with ProgressLine("pictures", 0, 0):
        pass
    assert capsys.readouterr().err == ""


def test_work_that_grows_is_never_more_than_whole(capsys):
    with ProgressLine("episodes", 2, 0) as line:
        line.advance(4, "")
    assert capsys.readouterr().err.startswith("4/4 episodes (100 %)")


@pytest.mark.parametrize("width", [40, 80, 200])
def test_numbers_are_whole_on_a_terminal_of_any_width(width):
    shown = on_terminal(width)
    assert "1200/1200" in shown
    assert "…" not in shown
    assert "14.4/s" in shown


def on_terminal(width: int) -> str:
    process, terminal = pty.fork()
    if not process:
        os.execv(sys.executable, [sys.executable, "-c", "import os; os.read(0, 1)\n" + WORK])
    ioctl(terminal, TIOCSWINSZ, pack("HHHH", 24, width, 0, 0))
    os.write(terminal, b"\n")
    shown = b""
    while True:
        try:
            shown += os.read(terminal, 4096)
        except OSError:  # its process has ended
            os.waitpid(process, 0)
            return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode("utf-8"))


def test_work_goes_on_when_nobody_reads_what_is_said():
    """As after `svaedc collect 2>&1 | head -1`."""
    program = "import sys; from cluster.progress import say\nfor i in range(9): say('x' * 99)\nsys.exit(7)"
    reading, writing = os.pipe()
    os.close(reading)
    assert subprocess.run([sys.executable, "-c", program], stderr=writing, check=False).returncode == 7
    os.close(writing)


def test_what_is_said_is_one_line(capsys):
    say("a word")
    assert capsys.readouterr().err == "a word\n"
