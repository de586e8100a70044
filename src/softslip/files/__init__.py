"""What is on disk: products, quantities, layouts, storage, conventions, seals and labels."""
