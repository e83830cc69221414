"""Studies: designs x seeds x stages, trained and evaluated as one graph of jobs."""
