"""The mistake in a code that is meant to be RATTLE: a dictionary of faulty steps, and what a code agrees with."""
