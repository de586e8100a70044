"""The trade of speed for accuracy: one scene over the numerical settings, with errors and costs."""
