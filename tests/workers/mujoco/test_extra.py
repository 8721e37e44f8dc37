"""An extra that is not installed is named."""

import subprocess
import sys

import pytest

from workers import setups
from workers.mujoco.extra import NEEDED, MissingExtraError

MUJOCO = [name for name in setups.SETUPS if name.endswith("-mujoco")]


@pytest.mark.parametrize("package", NEEDED)
@pytest.mark.parametrize("name", MUJOCO)
def test_setups_without_a_package_of_the_extra_say_which_extra_they_need(monkeypatch, name, package):
    monkeypatch.setattr(
        "workers.mujoco.extra.find_spec", lambda asked: None if asked == package else object()
    )
    with pytest.raises(MissingExtraError, match=rf"package {package}, .*pip install 'svaedc\[mujoco\]'"):
        setups.load(name)
    assert setups.load(name.removesuffix("-mujoco")).packages == ()


def test_loading_a_setup_imports_no_engine():
    """It costs a second, and the list of setups loads them all."""
    assert len(MUJOCO) == 4
    code = f"""
import sys
from workers import setups
for name in {MUJOCO}:
    setups.load(name)
print("mujoco" in sys.modules)
"""
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "False"
