"""Trained policies, and walking with them in plain MuJoCo, without PyTorch."""
