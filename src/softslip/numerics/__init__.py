"""Studies of the numerics: what is validated, traded and stretched, and what is published of it."""

from softslip.numerics.study import STUDIES, Study, load_study

__all__ = ["STUDIES", "Study", "load_study"]
