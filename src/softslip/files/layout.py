"""How the folder of a scenario's results is laid out."""

DATASET = ".nc"
"""Suffix of datasets."""

FIGURE = "figure"
"""What stands where a dataset has its stage."""

CHECKPOINTS = "checkpoints"
"""Folder of checkpoints and locks, beside the datasets of a stage."""
