"""Web pages of Draft: their addresses, and viser with a guard that judges requests."""
