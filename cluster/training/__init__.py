"""`svaedc train`: the model, fitted on Ray Train."""
