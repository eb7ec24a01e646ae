"""Long runs and ensembles of them."""
