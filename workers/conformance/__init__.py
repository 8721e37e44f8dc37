"""Whether a robot is what its setup says: the checks of `svaedc check` and of this project's own tests."""
