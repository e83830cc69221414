"""Web pages of Draft: their addresses, and viser behind a guard that checks requests."""
