"""The numbers of figures and datasets as CSV, for those who plot elsewhere.

One row a point, one column a coordinate, value or error. Lines that begin with ``#`` come first:
title, digests of the sources, and unit and meaning of each column. The columns' names are plain
words without units: pandas, R, Origin, gnuplot and NumPy take them as they are, while brackets and
blanks would be changed by some and have to be quoted in others. Excel shows all of it.

Numbers are the shortest decimals that read back as the same float64, or integers; flags are 1 and
0; what is not known is empty. The same source gives the same bytes.
"""

from softslip.provenance.export.csv_file import Column, Table, cells, save_csv, write_csv
from softslip.provenance.export.numbers import dataset_table, figure_table, target_table

__all__ = [
    "Column",
    "Table",
    "cells",
    "dataset_table",
    "figure_table",
    "save_csv",
    "target_table",
    "write_csv",
]
