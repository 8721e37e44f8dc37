"""Each guard between a controller and a robot is held by a test: without the guard, that test fails."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.contracts.guards import GUARDS

ROOT = Path(__file__).parents[2]
PARTS = ("workers", "svaedc", "cluster", "tests", "pyproject.toml", "ray_config.yaml")
NO_TESTS_FAILED, TESTS_FAILED = 0, 1


@pytest.fixture(scope="session")
def copy(tmp_path_factory):
    """The project once more, to be spoiled."""
    folder = tmp_path_factory.mktemp("spoiled")
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, folder / part)
    return folder


def run(folder, tests):
    file, *names = tests
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", file]
    command += ["-k", names[0]] if names else []
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    return done.returncode, done.stdout[-3000:]


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.what)
def test_the_guard_is_where_the_list_says(guard):
    assert (ROOT / guard.file).read_text(encoding="utf-8").count(guard.old) == 1


@pytest.mark.slow
@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.what)
def test_without_the_guard_a_test_fails(guard, copy):
    path = copy / guard.file
    whole = path.read_text(encoding="utf-8")
    path.write_text(whole.replace(guard.old, guard.new), encoding="utf-8")
    try:
        code, told = run(copy, guard.tests)
    finally:
        path.write_text(whole, encoding="utf-8")
    assert code == TESTS_FAILED, told


@pytest.mark.slow
def test_with_all_guards_these_tests_pass(copy):
    for tests in sorted({guard.tests for guard in GUARDS}):
        code, told = run(copy, tests)
        assert code == NO_TESTS_FAILED, told
