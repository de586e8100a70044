"""Where results come from: fingerprints, attribution, lineage, verification, traces, crates."""
