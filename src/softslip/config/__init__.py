"""What a scenario may say: parameters with unit, symbol, bounds and the paper's value; sweeps."""
