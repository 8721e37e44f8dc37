"""Where files of a dataset lie, and how each comes to be whole."""
