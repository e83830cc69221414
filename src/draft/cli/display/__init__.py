"""How the commands print: tables, progress, verdicts and JSON records."""
