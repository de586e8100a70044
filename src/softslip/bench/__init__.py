"""Benchmarks: the paper's scheme and the faster ones side by side in one process.

Each returns a plain dictionary, and `as_dataset` makes a dataset of it.
"""

from softslip.bench.elements import bench_elements
from softslip.bench.markdown import elements_table
from softslip.bench.memory import bench_memory
from softslip.bench.mobility import bench_mobility
from softslip.bench.results import as_dataset
from softslip.bench.run import bench_run
from softslip.bench.scaling import SIZES, bench_scaling
from softslip.bench.trajectory import bench_trajectory
from softslip.bench.trimming import bench_trimming

__all__ = [
    "SIZES",
    "as_dataset",
    "bench_elements",
    "bench_memory",
    "bench_mobility",
    "bench_run",
    "bench_scaling",
    "bench_trajectory",
    "bench_trimming",
    "elements_table",
]
