"""The picture of the architecture in the README is that of the import contracts and of the folders."""

import re
import tomllib

import pytest

from tests.documentation.pages import ROOT

PACKAGES = ("workers", "svaedc", "cluster")
TABLE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
PICTURE = (ROOT / "README.md").read_text(encoding="utf-8").partition("## How it is built")[2]


def layers(package: str) -> list[str]:
    """Each layer of a package, from the top, as its contract has it: rooms with | between them."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    return next(each["layers"] for each in contracts if each.get("containers") == [package])


def column(package: str) -> list[str]:
    """The lines of the picture below the name of a package, as far to the left as it and further."""
    lines = PICTURE.partition("```text\n")[2].partition("```")[0].splitlines()
    begin = next(number for number, line in enumerate(lines) if re.search(rf"(^| ){package}   ", line))
    place = lines[begin].index(package)
    right = 59 if place < 59 else None
    found = [line[place - 1 : right] for line in lines[begin + 2 :]]
    ends = (number for number, line in enumerate(found) if re.search(r"  the |─{20}", line))
    return found[: next(ends, len(found))]


@pytest.mark.parametrize("package", PACKAGES)
def test_the_picture_has_every_folder_and_their_order(package):
    words = [set(re.findall(r"\w+", line.partition(":")[0])) for line in column(package)]
    lines = {room: number for number, names in enumerate(words) for room in names}
    order = [[room.strip() for room in layer.split("|")] for layer in layers(package)]
    folders = {path.parent.name for path in (ROOT / package).glob("*/__init__.py")}
    assert folders - lines.keys() == set()
    drawn = [[lines[room] for room in layer if room in lines] for layer in order]
    places = [place for layer in drawn for place in sorted(layer)]
    assert places == sorted(places)


@pytest.mark.parametrize("package", PACKAGES)
def test_the_table_for_contributors_has_every_room_in_its_layer(package):
    """A remark in brackets names folders within a room; `__main__` is no room."""
    cell = re.search(rf"^\| `{package}/` \| ([^|]+) \|", TABLE, re.MULTILINE)
    assert cell
    told = [set(re.findall(r"`(\w+)`", layer)) for layer in re.sub(r"\(.*?\)", "", cell[1]).split(" · ")]
    named = [{room.strip() for room in layer.split("|")} for layer in layers(package)]
    assert told == [layer for layer in named if layer != {"__main__"}]
