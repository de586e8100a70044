"""From a figure, a dataset or a value back to what it was made from."""
