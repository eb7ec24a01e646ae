"""Methods: a name with a step size or a tolerance, and the way from an initial value problem to a trajectory."""

from daebench.systems.renamed_modules import keep_old_call

keep_old_call(__name__, "list_methods")
