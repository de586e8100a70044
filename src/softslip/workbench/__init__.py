"""Work from Python: runs without Snakemake, computed by the commands and kept in a folder.

`softslip.shear` is the entry. What it returns draws itself, through the accessor ``softslip``
of xarray.
"""
