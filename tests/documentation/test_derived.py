"""What the site derives from the code is whole, and what pages quote from the code stands in the code."""

import ast
import importlib.util
import re

import pytest

from tests.documentation.pages import DOCS, PAGES, ROOT, name

PACKAGES = ("cluster", "svaedc", "workers")
FOLDERS = "benchmarks|cluster|docs|examples|studies|svaedc|tests|workers"
OF_THE_READER = "workers/hardware/lab_arm.py"
"""A page tells its reader to write this file."""
TROUBLES = DOCS / "how-to" / "troubleshooting.md"


@pytest.fixture(scope="module")
def generated():
    """The hook of the site, which lies beside the pages and in no package."""
    spec = importlib.util.spec_from_file_location("generated", DOCS / "generated.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_derived_text_has_a_place_in_a_page(generated):
    places = [
        place for page in PAGES for place in re.findall(r"<!-- generated: (\w+) -->", page.read_text("utf-8"))
    ]
    assert sorted(places) == sorted(generated.DERIVED)


def test_the_page_of_commands_has_every_command_and_option(generated):
    text = generated.on_page_markdown("<!-- generated: commands -->", page=None)
    for path in (ROOT / "cluster" / "cli").glob("*.py"):
        options = re.findall(r'"(--[a-z-]+)"', path.read_text("utf-8"))
        assert [option for option in options if option not in text] == [], path
    for command in ("demo", "collect", "dataset verify", "hardware start", "hardware resolve"):
        assert f"`svaedc {command}`" in text


def test_the_page_of_settings_has_every_setting_with_its_default(generated):
    from cluster.config import Settings

    text = generated.on_page_markdown("<!-- generated: settings -->", page=None)
    for section, values in Settings():
        for key in type(values).model_fields:
            assert f"| `{section}.{key}` |" in text
    assert "| `compare.slots` | whole number > 0 | `2` |" in text
    assert "| `train.cache_folder` | path | `~/.cache/svaedc` |" in text


def strings() -> str:
    """All texts of the packages, with a gap for each value in them."""
    found = []
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.JoinedStr):
                    parts = [each.value if isinstance(each, ast.Constant) else "\0" for each in node.values]
                    found.append("".join(map(str, parts)))
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    found.append(node.value)
    return "\n".join(found)


def test_the_messages_of_the_troubleshooting_page_are_those_of_the_code():
    known = strings() + (ROOT / "Makefile").read_text("utf-8")
    rows = [line for line in TROUBLES.read_text("utf-8").splitlines() if line.startswith("| `")]
    messages = [message for row in rows for message in re.findall(r"`([^`]+)`", row.split(" | ")[0])]
    assert len(messages) > 40
    pieces = {message: [piece.strip(" '.?") for piece in re.split("…|'", message)] for message in messages}
    assert {m: p for m, parts in pieces.items() if (p := [each for each in parts if each not in known])} == {}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_tests_that_pages_name_exist(page):
    text = page.read_text("utf-8")
    tests = "\n".join(path.read_text("utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    named = re.findall(r"`(test_[a-z0-9_]+)`", text)
    assert [each for each in named if f"def {each}(" not in tests] == []
    paths = re.findall(rf"`((?:{FOLDERS})/[a-z0-9_/]+\.(?:py|md|urdf))`", text)
    assert [path for path in paths if path != OF_THE_READER and not (ROOT / path).exists()] == []
