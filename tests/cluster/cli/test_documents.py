"""`--json` prints one strict document on standard output, and nothing else there."""

import json
import subprocess
import sys

import pytest

from tests.cluster.cli.command_line import svaedc
from tests.cluster.hardware.desk import carry_out

NOISY = """
import ctypes, os, subprocess, sys
from cluster.cli.documents import one_document
with one_document() as document:
    print("python")
    ctypes.CDLL(None).puts(b"compiled")
    subprocess.run(["echo", "process"])
    document |= {"a": float("nan"), "b": [1]}
    if len(sys.argv) > 1:
        raise SystemExit(3)
"""


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", NOISY, *arguments], capture_output=True, text=True, check=False
    )


def document(text: str) -> dict:
    return json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def test_whatever_else_is_printed_goes_to_stderr():
    done = run()
    assert document(done.stdout) == {"a": None, "b": [1]}
    assert set(done.stderr.split()) == {"python", "compiled", "process"}


def test_a_command_that_fails_prints_no_document():
    done = run("fail")
    assert (done.returncode, done.stdout) == (3, "")


def test_dataset_info_says_as_json_what_it_says_to_people(small_dataset, tmp_path):
    done = svaedc("dataset", "info", "--json", str(small_dataset), folder=tmp_path)
    found = document(done.stdout)
    assert (found["setup"], found["episodes"], found["shards"]) == ("franka", 16, 2)
    assert found["statistics"]["diverged"] == 0
    assert found["statistics"]["objective"].keys() == {"0", "0.05", "0.25", "0.5", "0.75", "0.95", "1"}
    assert "object_tipped" in found["statistics"]["bad_steps"]
    assert found["bytes"] == sum(path.stat().st_size for path in small_dataset.glob("*.parquet"))
    assert {"name", "unit", "low", "high"} == found["channels"][0].keys()
    assert found["irreducible"] is None
    people = svaedc("dataset", "info", str(small_dataset), folder=tmp_path).stdout
    assert found["fingerprint"] in people
    assert found["identity"] in people


def test_hardware_status_is_one_document(tmp_path):
    carry_out(tmp_path)
    done = svaedc("hardware", "status", "--json", str(tmp_path), folder=tmp_path)
    found = document(done.stdout)
    assert (found["phase"], found["measured"], len(found["trials"])) == ("complete", 4, 4)
    broken = svaedc("hardware", "status", "--json", str(tmp_path / "none"), folder=tmp_path)
    assert (broken.returncode, broken.stdout) == (1, "")
    assert "no campaign in" in broken.stderr
