"""An error of a user's code, told in one line with its place."""

import importlib

import numpy as np
import pytest

from workers.user_code import describe


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Imports a text as a module in the working directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)

    def load(source: str, name: str):
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
        importlib.invalidate_caches()
        return importlib.import_module(name)

    return load


def raised(function) -> BaseException:
    with pytest.raises(Exception) as caught:  # noqa: PT011 - any
        function()
    return caught.value


def test_the_line_of_the_users_file_is_told(module):
    told = module('MASSES = {}\n\ndef mass():\n    return MASSES["puck"]\n', "told_key")
    assert (
        describe(raised(told.mass)) == "KeyError: 'puck', at told_key.py:4 in mass: return MASSES[\"puck\"]"
    )


def test_the_users_line_is_told_where_a_library_raised(module):
    told = module("import numpy as np\n\ndef add():\n    return np.ones(3) + np.ones(4)\n", "told_shape")
    assert "at told_shape.py:4 in add: return np.ones(3) + np.ones(4)" in describe(raised(told.add))


def test_a_line_that_is_no_python_is_told(module):
    error = raised(lambda: module("def step(:\n    pass\n", "told_syntax"))
    assert describe(error) == "SyntaxError: invalid syntax, at told_syntax.py:1"


def test_a_long_message_of_many_lines_is_one_line():
    told = describe(ValueError("one\n\n  two\n" + "x" * 1000))
    assert told.startswith("ValueError: one two xxx")
    assert told.endswith("…")
    assert "\n" not in told


def test_an_error_without_a_traceback_or_message_has_its_type():
    assert describe(RuntimeError()) == "RuntimeError"


def test_an_error_of_libraries_alone_has_a_place():
    assert ", at " in describe(raised(lambda: np.zeros(3).reshape(5)))
