"""The problem collection: one file a problem, each with a function ``problem(*, ...)`` that returns its definition."""
