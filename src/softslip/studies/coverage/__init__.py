"""How often verdicts on series err, and how often intervals hold the truth, on data made up."""

from softslip.studies.coverage.measured_coverage import measure_coverage

__all__ = ["measure_coverage"]
