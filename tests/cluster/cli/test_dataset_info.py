"""`svaedc dataset info` and `verify`: a whole dataset, a broken one, and one with a gap."""

import re
import shutil

import pytest

from tests.cluster.cli.command_line import svaedc


def test_dataset_info_and_verify_tell_a_whole_dataset_from_a_broken_one(small_dataset, tmp_path):
    info = svaedc("dataset", "info", str(small_dataset), folder=tmp_path)
    assert info.returncode == 0, info.stderr
    assert "16 in 2 shards" in info.stdout
    assert "object_tipped" in info.stdout
    assert re.search(r"diverged +0\b", info.stdout)
    assert re.search(r"stopped +0\b", info.stdout)
    assert svaedc("dataset", "verify", str(small_dataset), folder=tmp_path).returncode == 0
    broken = tmp_path / "broken"
    broken.mkdir()
    for path in small_dataset.iterdir():
        if path.is_file():
            (broken / path.name).write_bytes(path.read_bytes())
    victim = min(broken.glob("*.parquet"))
    content = bytearray(victim.read_bytes())
    content[5000] ^= 1
    victim.write_bytes(content)
    result = svaedc("dataset", "verify", str(broken), folder=tmp_path)
    assert result.returncode == 1
    assert victim.name in result.stdout
    assert f"`svaedc dataset repair {broken}` recomputes what is broken" in result.stderr


@pytest.mark.slow
def test_a_gap_is_told_from_damage_and_condemns_no_file(small_dataset, tmp_path):
    gappy = tmp_path / "gappy"
    shutil.copytree(small_dataset, gappy)
    first = min(gappy.glob("*.parquet"))
    first.unlink()
    first.with_name(f"{first.name}.sha256").unlink()
    result = svaedc("dataset", "verify", str(gappy), folder=tmp_path)
    assert result.returncode == 1
    assert result.stdout == "episodes 0 to 7 are not collected yet\n"
    assert "every file in" in result.stderr
    assert "delete" not in result.stderr
    assert svaedc("dataset", "info", str(gappy), folder=tmp_path).returncode == 0
