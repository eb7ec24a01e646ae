"""Engines against the truth: MuJoCo, EXUDYN, Pinocchio, OpenMM, Mici, jax-md and CasADi on motions whose exact course is known."""
