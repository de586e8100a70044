"""Whether results are what they say: their digests, their lineage, and whether they come again."""

from softslip.provenance.verification.reexecution import Outcome, Task, chosen, reexecute, tasks
from softslip.provenance.verification.survey import Verdict, Verification, verify

__all__ = ["Outcome", "Task", "Verdict", "Verification", "chosen", "reexecute", "tasks", "verify"]
