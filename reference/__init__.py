"""Trusted trajectories: how they are made, stored, checked and used."""
