"""The problem collection: one file per problem, each with a function ``problem(*, ...)`` that returns its definition."""

from daebench.systems.renamed_modules import keep_old_call

keep_old_call(__name__, "list_problems")
