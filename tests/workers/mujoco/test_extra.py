"""An extra that is not installed is named."""

import subprocess
import sys
from dataclasses import replace

import pytest

from workers import setups
from workers.dataset.identity import Identity, identity_of
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
from workers.dataset.identity import Identity, identity_of
for name in {MUJOCO}:
    setups.load(name)
print("mujoco" in sys.modules)
"""
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "False"


def test_the_identity_of_a_dataset_has_the_version_of_mujoco():
    identity = identity_of(setups.load("franka-mujoco"), seed=0, episodes_per_shard=4)
    assert [name for name, _ in identity.versions] == ["pybullet", "numpy", "mujoco"]
    assert Identity.from_json(identity.to_json()) == identity
    older = replace(identity, packages=(("mujoco", "3.0.0"),))
    assert any("mujoco" in line and "3.0.0" in line for line in identity.differences(older))
    assert "packages" not in identity_of(setups.load("franka"), seed=0, episodes_per_shard=4).to_json()
