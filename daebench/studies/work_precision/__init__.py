"""The cost of accuracy: errors of methods against their cost."""
