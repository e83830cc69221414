"""Output of the commands: tables, progress, verdicts and JSON records."""
