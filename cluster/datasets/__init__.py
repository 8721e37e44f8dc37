"""`svaedc collect` and what `svaedc dataset` does to a folder."""
