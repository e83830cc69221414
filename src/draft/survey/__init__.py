"""Public robot descriptions -> a table of segments -> the structure trends."""
