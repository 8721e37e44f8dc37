"""`svaedc compare`: methods side by side, on Ray Tune."""
