"""The points of the pellet that benchmarks train and predict at."""
RADII = "4.02,4.03,4.04,4.05,4.07,4.08,4.09,4.1"
LOADS = ",".join(f"{k / 25:g}" for k in range(1, 26))
TRAIN_LOADS = "0.2,0.4,0.48,0.56,0.64,0.72,0.8,0.88,0.96,1"
TRAIN = ["-values_radius", RADII, "-values_load", TRAIN_LOADS]
