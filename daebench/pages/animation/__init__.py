"""Animations: the scene of each method side by side, with the errors of energy and of conserved quantities below.

A run is recorded at the times that are shown, from states of the run itself; between two of them every step is monitored, and the curves
are made of the largest errors since the state before. Nothing is interpolated.
"""
