"""Results of a study as plain text that is small enough to be committed, and what they show."""
