"""The names of the methods are all there, and cost nothing to import."""

import subprocess
import sys

from svaedc.bo import method_names, methods


def test_every_method_that_is_made_has_a_name_and_every_name_is_made():
    assert methods.SURROGATES.keys() == method_names.CONTROLLERS.keys()
    assert methods.LATENT_SURROGATES.keys() == method_names.LATENT.keys()
    assert methods.SIMULATED_SURROGATES.keys() == method_names.PRIORS.keys()
    assert methods._UNLEARNT.keys() == (method_names.RANDOM | method_names.SIMULATED).keys()
    assert tuple(methods._SEARCHES) == method_names.SEARCHES
    assert tuple(methods._ACQUISITIONS) == method_names.ACQUISITIONS


def test_a_name_ships_if_it_is_a_method_with_or_without_what_may_stand_behind_it():
    names = ("se", "se-acqf-ei", "random", "se-pool", "mine", "se-ei-acqf", "my_module:se", "-ei")
    assert [name for name in names if method_names.ships(name)] == ["se", "se-acqf-ei", "random", "se-pool"]


def test_names_load_neither_torch_nor_numpy():
    program = "import svaedc.bo.method_names, sys; print(sorted({'torch', 'numpy'} & sys.modules.keys()))"
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"
