"""The rules of the house that no other tool checks: small rooms, unique names, docstrings that say all."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("cluster", "svaedc", "workers")
MODULES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
LARGEST_ROOM = 16
LONGEST_MODULE = 300  # lines; docstrings are a third of them
HELP = (
    ROOT / "cluster" / "cli",
    *(ROOT / "cluster" / "console" / f"{name}.py" for name in ("decisions", "entrance", "looks")),
)
"""What these take is said where people meet it: in `--help`, and in forms."""
"""The docstrings of commands are what `--help` prints."""
VERBS = frozenset({"read", "put", "set", "cut", "split", "need", "seed", "proceed"})
IRREGULAR = frozenset(
    {"found", "begun", "known", "told", "drawn", "held", "lost", "spent", "given", "done", "made"}
)
KEPT = frozenset(
    {
        f"{name}.observed"
        for name in (
            *("Environment", "Daisy", "GymnasiumWorld", "Point", "Tabletop"),
            *("MujocoDaisy", "MujocoTabletop"),
        )
    }
    | {"Outcome.found"}
)
"""What users' own environments implement keeps its name."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def functions(path: Path) -> Iterator[tuple[str, Function]]:
    """Functions of a module and methods of its classes, by qualified name."""
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, Function):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            yield from (
                (f"{node.name}.{each.name}", each) for each in node.body if isinstance(each, Function)
            )


def is_public(name: str) -> bool:
    return not any(part.startswith("_") for part in name.split("."))


def parameters(function: Function) -> list[str]:
    given = function.args
    every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    return [each.arg for each in every if each and each.arg not in ("self", "cls")]


def is_property(function: Function) -> bool:
    return any(
        getattr(each, "id", getattr(each, "attr", "")) == "property" for each in function.decorator_list
    )


def unsaid(function: Function) -> list[str]:
    """The sections that a docstring lacks."""
    text = ast.get_docstring(function) or ""
    returns = function.returns is not None and ast.unparse(function.returns) not in ("None", "NoReturn")
    lacks = [] if "Args:" in text else ["Args"]
    return [*lacks, "Returns"] if returns and not {"Returns:", "Yields:"} & set(text.split()) else lacks


def test_no_room_holds_more_modules_than_one_remembers():
    rooms = Counter(path.parent for path in MODULES if path.name != "__init__.py")
    assert {str(room): count for room, count in rooms.items() if count > LARGEST_ROOM} == {}


def test_no_module_is_too_long_to_read():
    lengths = {str(path.relative_to(ROOT)): path.read_text().count("\n") for path in MODULES}
    assert {name: length for name, length in lengths.items() if length > LONGEST_MODULE} == {}


def test_every_class_name_exists_once():
    names = Counter(
        node.name
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef) and is_public(node.name)
    )
    assert [name for name, count in names.items() if count > 1] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_public_functions_say_what_they_take_and_what_they_return(package):
    lacking = {
        f"{path.relative_to(ROOT)}:{name}": unsaid(function)
        for path in MODULES
        if path.is_relative_to(ROOT / package) and not any(path.is_relative_to(place) for place in HELP)
        for name, function in functions(path)
        if is_public(name) and len(parameters(function)) > 1
    }
    assert {name: sections for name, sections in lacking.items() if sections} == {}


def test_functions_are_verbs_or_what_they_return():
    """A bare participle (`planned`, `found`) tells neither; properties may be one."""
    participles = [
        f"{path.relative_to(ROOT)}:{name}"
        for path in MODULES
        for name, function in functions(path)
        if name not in KEPT and not is_property(function) and is_participle(name.rpartition(".")[2])
    ]
    assert participles == []


def is_participle(name: str) -> bool:
    word = name.strip("_")
    return "_" not in word and word not in VERBS and (word.endswith("ed") or word in IRREGULAR)
