"""Rolling out shards: one of them, what all will cost, and once more as a proof."""
