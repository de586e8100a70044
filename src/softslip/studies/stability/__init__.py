"""Where the scheme stays stable and correct, and how it stops where it does not."""

from softslip.studies.stability.axes import GROUPS
from softslip.studies.stability.longest_steps import measure_limits
from softslip.studies.stability.map_dataset import gather, measure_group
from softslip.studies.stability.map_design import MapDesign

__all__ = ["GROUPS", "MapDesign", "gather", "measure_group", "measure_limits"]
