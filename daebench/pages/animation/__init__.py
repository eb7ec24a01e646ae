"""Animations: the scene of each method beside the others, and under it what becomes of energy and of what the structure keeps.

A run is recorded at the times that are shown, from states of the run itself; between two of them every step is monitored, and the curves
are made of the largest errors since the state before. Nothing is interpolated.
"""
