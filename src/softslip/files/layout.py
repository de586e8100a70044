"""How the folder of a scenario's results is laid out."""

DATASET = ".nc"
"""Suffix of datasets."""

CHECKPOINTS = "checkpoints"
"""Folder of checkpoints and locks, beside the datasets of a stage."""
