"""Speed, as ratios to MuJoCo's own work in the same run."""
