"""The real browser of the tests, quiet: it asks nothing of the network but what a test opens."""

import shutil

import pytest

QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage",
)  # fmt: skip


def found(*programs: str) -> list[str]:
    """Where these programs are; skips the test where one is missing."""
    places = [shutil.which(program) for program in programs]
    if None in places:
        pytest.skip(f"no {' or no '.join(programs)} on PATH; `.ci/run` installs them")
    return places


def command(*options: str) -> list[str]:
    """Chromium with these options, as a command."""
    return [*found("chromium"), *QUIET, *options]
