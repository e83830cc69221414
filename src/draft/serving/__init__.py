"""Pages for a browser: addresses, and viser behind a guard that checks who asks."""
