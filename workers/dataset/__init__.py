"""The dataset contract: Parquet shards that are pure functions of an identity and an episode range."""
