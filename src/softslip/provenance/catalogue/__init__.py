"""The runs in a folder of results, found by their parameters and provenance."""
