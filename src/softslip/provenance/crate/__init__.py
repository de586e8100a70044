"""Research objects: a scenario's results with what they were made from, as an RO-Crate."""

from softslip.provenance.crate.contents import Contents, collect
from softslip.provenance.crate.entities import METADATA, files_of
from softslip.provenance.crate.graph import Credits
from softslip.provenance.crate.writing import (
    check_archive,
    check_folder,
    write_archive,
    write_folder,
)

__all__ = [
    "METADATA",
    "Contents",
    "Credits",
    "check_archive",
    "check_folder",
    "collect",
    "files_of",
    "write_archive",
    "write_folder",
]
