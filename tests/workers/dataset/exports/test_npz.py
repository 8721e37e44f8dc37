"""Archives of NumPy hold the numbers of the dataset."""

import json

import numpy as np

from tests.workers.dataset.exports.columns import joined
from workers.dataset.exports.npz import export_npz


def archive(path):
    with np.load(path, allow_pickle=False) as opened:
        return dict(opened)


def test_archives_hold_the_columns_and_what_their_axes_mean(dataset, rows, tmp_path):
    assert list(export_npz(dataset, tmp_path)) == dataset.shards()
    opened = [archive(path) for path in sorted(tmp_path.glob("*.npz"))]
    for name in ("episode", "x", "xi", "bad", "y", "f"):
        exported = np.concatenate([each[name] for each in opened])
        assert exported.dtype == joined(rows, name).dtype
        np.testing.assert_array_equal(exported, joined(rows, name))
    assert opened[0]["xi"].shape == (8, 3, 20)
    assert opened[0]["stop"].tolist() == list(rows[0].stop)
    assert opened[0]["physics_names"].tolist() == ["friction", "mass"]
    np.testing.assert_array_equal(opened[0]["physics"][:, 1], rows[0].physics["mass"])
    assert opened[0]["observation_names"].tolist() == ["joint", "object_x", "object_y"]
    assert opened[0]["observation_units"].tolist() == ["rad", "m", "m"]
    assert opened[0]["condition_names"].tolist() == ["tipped", "off_table"]
    assert json.loads((tmp_path / "dataset.json").read_text())["setup"] == "toy"
