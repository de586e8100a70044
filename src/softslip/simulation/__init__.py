"""The four stages of a run: packing, expansion, ageing, shear; what is recorded and resumed."""
