"""Work on results: locks, status, plans, removal, progress."""
