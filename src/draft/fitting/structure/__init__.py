"""Structure laws from public robot descriptions, through a table of segments."""
