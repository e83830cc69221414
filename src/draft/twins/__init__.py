"""A real robot beside the model that Draft predicts for it."""
