"""Training: runs, their progress, and the learning itself."""
