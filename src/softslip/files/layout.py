"""How the folder of a scenario's results is laid out."""

DATASET = ".nc"
"""Suffix of datasets."""

PAGE = ".html"
"""Suffix of pages for a browser."""

FIGURE = "figure"
"""What stands where a dataset has its stage."""

CHECKPOINTS = "checkpoints"
"""Folder of checkpoints and locks, beside the datasets of a stage."""


def benchmark_of(name: str) -> str:
    """Return where Snakemake notes what the job that made a result took.

    Parameters
    ----------
    name
        Path of the result in the folder of the results, with slashes.
    """
    return f"benchmarks/{name.rpartition('.')[0]}.tsv"
