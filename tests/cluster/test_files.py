"""One command at a time works in a folder."""

import subprocess
import sys

import pytest

from cluster.errors import UserError
from cluster.files import alone_in

HOLDER = """
import os, sys, time
from pathlib import Path
from cluster.files import alone_in
with alone_in(Path(sys.argv[1]), "taken"):
    print("held", flush=True)
    time.sleep(600)
"""


def test_a_second_command_is_told_what_it_was_given_to_say_and_a_later_one_gets_in(tmp_path):
    with alone_in(tmp_path, "first"), pytest.raises(UserError, match=r"^taken$"), alone_in(tmp_path, "taken"):
        pytest.fail("two are in the folder")
    with alone_in(tmp_path, "again"):
        assert list(tmp_path.iterdir()) == []


def test_a_killed_command_leaves_the_folder_free(tmp_path):
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(UserError, match="taken"), alone_in(tmp_path, "taken"):
            pytest.fail("two are in the folder")
        holder.kill()
        holder.wait()
        with alone_in(tmp_path, "taken"):
            assert holder.returncode < 0
