"""Reports of a few designs: one HTML page that opens offline, and its figures."""
