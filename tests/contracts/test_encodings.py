"""UTF-8 is stated wherever text is read or written: the system may take ASCII for granted (`LC_ALL=C`)."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ("benchmarks", "cluster", "examples", "studies", "svaedc", "workers")
HANDLERS = frozenset({"FileHandler", "RotatingFileHandler", "TextIOWrapper"})
OPENING = frozenset({"open", "fdopen", "NamedTemporaryFile", "TemporaryFile", "SpooledTemporaryFile"})
BINARY = frozenset({"Image", "av", "os", "tarfile", "zipfile"})
"""What these modules open is no text."""
MODE = frozenset("rwxa+t")


def unstated(tree: ast.AST) -> Iterator[int]:
    """Lines of calls that leave the encoding of text to the system."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and leaves_it_open(node):
            yield node.lineno


def leaves_it_open(call: ast.Call) -> bool:
    keywords = {each.arg: each.value for each in call.keywords}
    if "encoding" in keywords:
        return False
    name = called(call.func)
    if name in {"read_text", "write_text"}:  # of a path; those of `cluster.files` state it themselves
        return isinstance(call.func, ast.Attribute) and called(call.func.value) != "files"
    if name in HANDLERS:
        return True
    if name in OPENING and not (isinstance(call.func, ast.Attribute) and called(call.func.value) in BINARY):
        return opens_text(call, keywords)
    return any(is_true(keywords.get(switch)) for switch in ("text", "universal_newlines"))


def called(function: ast.expr) -> str:
    return getattr(function, "attr", getattr(function, "id", ""))


def is_true(value: ast.expr | None) -> bool:
    return isinstance(value, ast.Constant) and value.value is True


def opens_text(call: ast.Call, keywords: dict[str | None, ast.expr]) -> bool:
    """Whether a mode of text is given, or none to a function that then reads text."""
    given = [*call.args, *[keywords[name] for name in ("mode",) if name in keywords]]
    words = [each.value for each in given if isinstance(each, ast.Constant) and isinstance(each.value, str)]
    if any(MODE.issuperset(word) and word for word in words):
        return True
    return isinstance(call.func, ast.Name) and call.func.id == "open" and len(given) == 1


@pytest.mark.parametrize("package", SOURCES)
def test_no_text_is_read_or_written_in_an_encoding_of_the_systems(package):
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for line in unstated(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert found == []


@pytest.mark.parametrize(
    ("line", "is_found"),
    [
        ("path.read_text()", True),
        ("path.read_text(encoding='utf-8')", False),
        ("path.write_text('text')", True),
        ("files.write_text(path, 'text')", False),
        ("open(path)", True),
        ("open(path, 'rb')", False),
        ("path.open('a')", True),
        ("path.open('ab+')", False),
        ("setup.open()", False),
        ("Image.open(path)", False),
        ("av.open(path, 'w')", False),
        ("NamedTemporaryFile('w', suffix='.urdf')", True),
        ("TemporaryFile()", False),
        ("run(command, text=True)", True),
        ("run(command, encoding='utf-8')", False),
        ("logging.FileHandler('log')", True),
    ],
)
def test_the_rule_finds_what_it_shall(line, is_found):
    assert bool(list(unstated(ast.parse(line)))) == is_found
