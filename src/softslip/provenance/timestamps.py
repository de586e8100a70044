"""Times of files, by which Snakemake tells what is out of date, brought in line with digests.

Every result notes the digests of what it was made from. A plain copy or an unpacked archive has
times in any order, and a result that was lost and recomputed is newer than what was made from the
lost one: where the content is that which was noted, there is no reason to rerun anything. And where
it is not, there is one, however old it looks.
"""

import os
from collections.abc import Iterable
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from softslip.files.layout import benchmark_of
from softslip.provenance.archive import Archive
from softslip.provenance.product_labels import Product

_EARLIER = 1_000_000_000
"""By how much what is out of date is made older than what was replaced [ns]."""


def put_in_order(results: Path) -> list[Path]:
    """Make no result older than what it was made from, but those that were made from other content.

    Nothing but times is changed. Results that do not say what they were made from keep theirs, and
    so do those whose times this user may not change.

    Parameters
    ----------
    results
        Folder of a scenario's results.

    Returns
    -------
        The files whose times were changed.
    """
    archive = Archive(results)
    products = {each.path: each for each in archive.products() if isinstance(each, Product)}
    parents = {path: _parents(archive, product, products) for path, product in products.items()}
    try:
        order = list(TopologicalSorter(parents).static_order())
    except CycleError:
        return []  # No workflow has made these.
    times: dict[Path, int] = {}
    moved = []
    for path in order:
        try:
            times[path] = path.stat().st_mtime_ns
            needed = _consistent(
                times[path], [(times[at], same) for at, same in parents[path].items()]
            )
            if needed != times[path]:
                times[path] = _dated(path, times[path], needed)
                moved.append(path)
            moved += _benchmark_dated(results, path, times[path])
        except OSError:
            times.setdefault(path, 0)  # Gone meanwhile, or another user's.
    return moved


def _benchmark_dated(results: Path, path: Path, time: int) -> list[Path]:
    """Make the note of what a job took no older than its result, for whose age it counts."""
    note = results / benchmark_of(path.relative_to(results).as_posix())
    if not note.is_file() or note.stat().st_mtime_ns >= time:
        return []
    _dated(note, note.stat().st_mtime_ns, time)
    return [note]


def _parents(archive: Archive, product: Product, products: dict[Path, Product]) -> dict[Path, bool]:
    """Return the files that a product was made from, and whether each is as it was then."""
    places = {archive.place(parent): parent for parent in product.parents}
    return {
        path: products[path].content == parent.content
        for path, parent in places.items()
        if path in products
    }


def _consistent(time: int, parents: Iterable[tuple[int, bool]]) -> int:
    """Return the time that a file should have, by the times of its parents [ns]."""
    known = list(parents)
    replaced = [parent for parent, same in known if not same]
    if not replaced:
        return max([time, *(parent for parent, _ in known)])
    return time if time < max(replaced) else max(replaced) - _EARLIER


def _dated(path: Path, time: int, needed: int) -> int:
    """Give a file a time, or the present one where it is another user's; return which it has."""
    try:
        os.utime(path, ns=(needed, needed))
    except PermissionError:
        if needed < time:
            raise
        os.utime(path)
    return path.stat().st_mtime_ns
