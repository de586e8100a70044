"""What Snakemake's report shows beside the figures: its first page, and pages of tables."""
