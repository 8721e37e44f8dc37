"""An extra that is not installed is named."""

import sys

import pytest

from workers import setups
from workers.mujoco.library import MissingExtraError, import_extra


def test_a_package_that_is_missing_leads_to_its_extra():
    with pytest.raises(MissingExtraError, match=r"mujocco.*pip install 'svaedc\[mujoco\]'"):
        import_extra("mujocco")


@pytest.mark.parametrize("name", ["franka-mujoco", "yumi-mujoco", "daisy-27d-mujoco", "daisy-11d-mujoco"])
def test_setups_without_mujoco_say_which_extra_they_need(monkeypatch, name):
    for module in [each for each in sys.modules if "mujoco" in each]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(LookupError, match=r"pip install 'svaedc\[mujoco\]'"):
        setups.load(name)
    assert setups.load(name.removesuffix("-mujoco")).packages == ()
