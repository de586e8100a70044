"""Whether results are what they say: digests, lineage, and whether they are reproducible."""

from softslip.provenance.verification.reexecution import (
    Rerun,
    RerunOutcome,
    possible_reruns,
    reexecute,
    sampled,
)
from softslip.provenance.verification.survey import Verdict, Verification, verify

__all__ = [
    "Rerun",
    "RerunOutcome",
    "Verdict",
    "Verification",
    "possible_reruns",
    "reexecute",
    "sampled",
    "verify",
]
