"""Pages of a study: its report, and its collected results, from one set of sections."""
