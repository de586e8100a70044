"""How the folder of a scenario's results is laid out."""

DATASET = ".nc"
"""Suffix of datasets."""

CHECKPOINTS = "checkpoints"
"""Folder of checkpoints and locks, beside the datasets of a stage."""

LOGS = "logs"
"""Folder of what the runs of each stage have said, beside the folders of the stages."""
