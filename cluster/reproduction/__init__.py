"""`svaedc reproduce`: the figures of the paper, from data to verdict."""
