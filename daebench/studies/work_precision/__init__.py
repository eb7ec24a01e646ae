"""The price of accuracy: errors of methods against their cost."""
