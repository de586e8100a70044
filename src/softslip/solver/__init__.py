"""The core: arrays in, arrays out. It knows no parameters of a scenario, no files and no runs."""
