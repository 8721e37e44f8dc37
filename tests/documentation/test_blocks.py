"""Every block of the documentation is run by `make test-docs`, or says why it is not."""

from collections import Counter

import pytest

from tests.documentation.console import Done, is_printed
from tests.documentation.pages import PAGES, Fence, Step, fences, name

SHOWN = ("text", "json", "toml", "yaml", "bibtex")
"""Fences in these languages are to be looked at."""
every_page = pytest.mark.parametrize("page", PAGES, ids=name)

NOT_RUN = {
    "CONTRIBUTING.md": 1,
    "README.md": 1,
    "docs/how-to/check.md": 1,
    "docs/how-to/clusters.md": 1,
    "docs/how-to/console.md": 3,
    "docs/how-to/drivers.md": 3,
    "docs/how-to/engines.md": 2,
    "docs/how-to/export.md": 1,
    "docs/how-to/gymnasium.md": 4,
    "docs/how-to/object-stores.md": 1,
    "docs/how-to/pictures.md": 2,
    "docs/how-to/plug-ins.md": 6,
    "docs/how-to/reproduce.md": 2,
    "docs/how-to/hebi.md": 3,
    "docs/how-to/ten-trials.md": 1,
    "docs/how-to/train.md": 2,
    "docs/results/benchmarks.md": 1,
    "docs/results/daisy.md": 1,
    "docs/results/engines.md": 2,
    "docs/results/franka.md": 3,
    "docs/results/quadratic.md": 1,
    "docs/results/reproduction.md": 1,
    "docs/results/ten-trials.md": 2,
    "docs/results/transfer.md": 2,
    "docs/tutorial/first-steps.md": 5,
}
"""So many blocks of these pages are not run; each says why in a comment above it."""


@every_page
def test_every_fence_says_what_it_holds(page):
    known = ("console", "python", *SHOWN)
    assert [fence.line for fence in fences(page) if fence.language not in known] == []


@every_page
def test_commands_stand_in_consoles(page):
    """A text that begins as a command does would be one that nobody runs."""
    texts = [fence for fence in fences(page) if fence.language in SHOWN and not fence.title]
    assert [fence.line for fence in texts if _holds_a_command(fence)] == []
    consoles = [fence for fence in fences(page) if fence.language == "console"]
    assert [fence.line for fence in consoles if not fence.text.startswith("$ ")] == []


def _holds_a_command(fence: Fence) -> bool:
    starts = ("$ ", "svaedc ", "make ", "pip ", "python ", "ray ")
    return any(line.startswith(starts) for line in fence.text.splitlines())


def test_few_blocks_are_not_run():
    found = Counter(
        name(page)
        for page in PAGES
        for fence in fences(page)
        if fence.reason and fence.language in ("console", "python")
    )
    assert dict(found) == NOT_RUN


@pytest.mark.parametrize(
    ("expected", "printed", "status", "agrees"),
    [
        ("data is whole: 8 episodes", "data is whole: 8 episodes\n", 0, True),
        ("data is whole: 8 episodes", "data is whole: 9 episodes\n", 0, False),
        ("8 new in … s", "8 new in 2.1 s\n", 0, True),
        ("one\n…\nlast", "one\ntwo\nthree\nlast\n", 0, True),
        ("one\n…", "two\n", 0, False),
        ("error: no such setup", "error: no such setup\n", 2, True),
        ("error: no such setup", "error: no such setup\n", 0, False),
        ("", "", 1, False),
    ],
)
def test_a_page_is_held_against_what_is_printed(expected, printed, status, agrees):
    assert (Done(Step(1, "svaedc", expected), printed, status).complaint() == "") is agrees


@pytest.mark.parametrize(
    ("expected", "printed", "is_equal"),
    [
        ("…\n…data holds 512 episodes, 11.… MB", "256/512\n/tmp/data holds 512 episodes, 11.8 MB\n", True),
        ("…\nfranka: badness 0.2… (tipped)", "franka:  badness 0.20\n(tipped)", True),
        ("data is whole: … shards", "data is whole: 512 episodes in 19 shards", True),
        ("data is whole: 16 shards", "data is whole: 19 shards", False),
        ("data is whole", "data is whole: 19 shards", False),
    ],
)
def test_a_page_leaves_out_what_differs_and_nothing_else(expected, printed, is_equal):
    assert is_printed(expected, printed) is is_equal
