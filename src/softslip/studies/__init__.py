"""How well the numerics do: known solutions, speed against accuracy, extremes, benchmarks."""
