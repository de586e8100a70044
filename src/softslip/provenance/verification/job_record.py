"""Whether results say how they were made, by which job and when, and whether that can be."""

from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta
from typing import Any

from softslip.messages import brief
from softslip.provenance.attribution import PROVENANCE, UNKNOWN
from softslip.provenance.product_labels import Product

NOTED = (*PROVENANCE, "parent_records")
"""What a product must say of how it was made."""

CLOCK_SLACK = timedelta(seconds=60)
"""By how much times may be out of order: clocks are set, and those of two hosts differ."""


def job_faults(product: Product) -> Iterator[str]:
    """Yield what is wrong with what a product says of how it was made, and with its times."""
    record = product.provenance
    missing = [key for key in NOTED if record.get(key) is None and not _may_be_none(key, record)]
    if missing:
        yield f"does not note its {', '.join(missing)}"
        return
    if len(record["parent_records"]) != len(product.parents):
        yield "does not note the record of each of its parents"
    for key in ("core_seconds", "threads"):
        if not isinstance(record[key], int | float) or record[key] < 0:
            yield f"its {key} is {brief(record[key])}, which is no number from 0 on"
    for key in ("started", "ended"):
        if _moment(product, key) is None:
            yield f"its time {key} is {brief(record[key])}, which is none"
    if is_after(product, "started", product, "ended", CLOCK_SLACK):
        yield f"ended at {record['ended']}, before it started at {record['started']}"


def _may_be_none(key: str, record: Mapping[str, Any]) -> bool:
    """Return whether nothing is all that can be known: outside a checkout nothing can be dirty."""
    return key == "dirty" and key in record and record.get("commit") == UNKNOWN


def _moment(product: Product, key: str) -> datetime | None:
    """Return a time of a product's provenance, None where it is no time."""
    try:
        moment = datetime.fromisoformat(str(product.provenance.get(key)))
    except ValueError:
        return None
    return moment if moment.tzinfo is not None else None


def is_after(
    product: Product, key: str, other: Product, other_key: str, slack: timedelta = timedelta()
) -> bool:
    """Return whether a time of a product is known to be later than one of another."""
    time, before = _moment(product, key), _moment(other, other_key)
    return time is not None and before is not None and time > before + slack
