"""Benchmarks: the paper's scheme and the faster ones side by side in one process.

Each returns a plain dictionary, and `as_dataset` makes a dataset of it.
"""

from softslip.studies.bench.datasets import as_dataset
from softslip.studies.bench.elements import bench_elements
from softslip.studies.bench.mobility import bench_mobility
from softslip.studies.bench.run import bench_run
from softslip.studies.bench.scaling import SIZES, bench_scaling
from softslip.studies.bench.trajectories import bench_trajectory

__all__ = [
    "SIZES",
    "as_dataset",
    "bench_elements",
    "bench_mobility",
    "bench_run",
    "bench_scaling",
    "bench_trajectory",
]
