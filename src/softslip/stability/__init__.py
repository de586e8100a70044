"""Where the scheme stays stable and correct, and how it stops where it does not."""

from softslip.stability.cells import GROUPS
from softslip.stability.limits import measure_limits
from softslip.stability.measure import gather, measure_group
from softslip.stability.plan import Plan

__all__ = ["GROUPS", "Plan", "gather", "measure_group", "measure_limits"]
