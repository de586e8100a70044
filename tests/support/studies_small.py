"""The smallest study, which tests run parts of."""

from pathlib import Path

from softslip.config.reading import read_mapping
from softslip.studies.stability.map_design import MapDesign

SMALL_MAP = MapDesign.of(
    read_mapping(Path(__file__).parents[2] / "config/numerics/ci.yaml")["stability"]
)
"""The map of stability at the size that continuous integration affords."""
