"""Methods: each a name with a step size or a tolerance, which turns an initial value problem into a trajectory."""

from daebench.systems.renamed_modules import keep_old_call

keep_old_call(__name__, "list_methods")
