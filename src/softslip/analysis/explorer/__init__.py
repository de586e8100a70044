"""A page for the browser that shows all runs of a scenario: Datasets → HTML.

`page` puts it together; its layout, style and program are the files beside it.
"""
