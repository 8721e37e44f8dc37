"""One command at a time works in a folder, and JSON is strict."""

import json
import math
import subprocess
import sys

import pytest

from cluster.errors import UserError
from cluster.files import alone_in, json_text, read_json, write_json

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


def test_json_has_null_for_numbers_that_it_lacks_and_all_else_as_it_was(tmp_path):
    content = {"a": math.nan, "b": [math.inf, 1.5, (-math.inf,)], "c": {"d": math.nan, "e": "NaN", "f": True}}
    write_json(tmp_path / "some.json", content)
    found = json.loads((tmp_path / "some.json").read_text(), parse_constant=pytest.fail)
    assert found == {"a": None, "b": [None, 1.5, [None]], "c": {"d": None, "e": "NaN", "f": True}}
    whole = {"a": 0.1, "b": [1, "x", None]}
    assert json_text(whole) == json.dumps(whole, indent=2)
    assert json_text(whole, indent=None) == json.dumps(whole)


def test_the_nan_of_older_files_is_read(tmp_path):
    (tmp_path / "old.json").write_text('{"a": NaN}')
    assert math.isnan(read_json(tmp_path / "old.json")["a"])
