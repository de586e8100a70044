"""Dataset to dataset to figure: observables, fits, figures, the paper's values. No solver."""
