"""The problem collection: one file per problem, each with a function ``problem(*, ...)`` that returns its definition."""
