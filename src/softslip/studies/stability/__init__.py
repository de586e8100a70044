"""Where the scheme stays stable and correct, and how it stops where it does not."""

from softslip.studies.stability.cells import GROUPS
from softslip.studies.stability.limits import measure_limits
from softslip.studies.stability.measure import gather, measure_group
from softslip.studies.stability.plan import Plan

__all__ = ["GROUPS", "Plan", "gather", "measure_group", "measure_limits"]
