"""Times of files, by which Snakemake tells what is out of date.

A result that was lost and recomputed is newer than what was made from the lost one, so that
Snakemake would rerun all of that. Where the content is the same there is no reason to.
"""

import os
from collections import defaultdict
from pathlib import Path

from softslip.provenance.archive import Archive
from softslip.provenance.product_labels import Product


def keep_in_order(results: Path, since: float) -> list[Path]:
    """Date back what was recomputed with the same content, and return it.

    Parameters
    ----------
    results
        Folder of a scenario's results.
    since
        POSIX time from which on files are new.
    """
    archive = Archive(results)
    modified = {path: path.stat().st_mtime_ns for path in archive.files}
    begun = int(since * 1e9)
    if not any(time >= begun for time in modified.values()) or min(modified.values()) >= begun:
        return []
    products = [each for each in archive.products() if isinstance(each, Product)]
    children = _children(products)
    moved = []
    for product in products:
        path, made = product.path, children[product.stage, product.run]
        older = [modified[child] for child, _ in made if modified[child] < modified[path]]
        same = all(content == product.content for _, content in made)
        if modified[path] >= begun and older and same:
            os.utime(path, ns=(min(older), min(older)))
            moved.append(path)
    return moved


def _children(products: list[Product]) -> defaultdict[tuple[str, str], list[tuple[Path, str]]]:
    """Return what was made from each stage and run, and which content that had."""
    found: defaultdict[tuple[str, str], list[tuple[Path, str]]] = defaultdict(list)
    for product in products:
        for parent in product.parents:
            found[parent.stage, parent.run].append((product.path, parent.content))
    return found
