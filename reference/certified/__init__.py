"""Certified references: trajectories whose every digit was checked, how they are made, kept, verified and used."""
