"""Source of the least-squares solution of small linear systems, which may be singular."""

from daebench.compiler.codegen import function, pack

DEPENDENT = {"float64": 4e-11, "float32": 2e-5, "complex128": 4e-11}
"""What is left of a column, relative to the first, below which least squares take it for dependent: eps^(2/3) of the number type.

Of G M^-1 G^T that is the square of an angle, as the relative pivots of elimination are.
"""


def least_squares_solver(name: str, n: int, dtype: str) -> str:
    """Source of the least-squares solution of A x = b of least norm, in loops, by QR with column pivoting.

    ``name(A, b)`` returns x and the smallest diagonal entry of R that was kept, relative to the first; 0 where there is none, NaN where
    A is not finite. Rows, then columns, are first scaled to have a largest modulus of 1, so that units do not matter; the norm is that of
    the scaled x. A P = Q R is found by modified Gram-Schmidt with b as a last column, and ended where what is left of the columns is
    below :data:`DEPENDENT`. Products are taken without conjugation, so that an imaginary part carries a derivative.
    """
    return function(
        f"{name}(A, b)",
        f"a = numpy.empty(({n}, {n + 1}), dtype=numpy.{dtype})",
        *(f"a[{i}, {j}] = A[{i}][{j}]" for i in range(n) for j in range(n)),
        *(f"a[{i}, {n}] = b[{i}]" for i in range(n)),
        f"r, x, null = numpy.zeros(({n}, {n + 1}), a.dtype), numpy.zeros({n}, a.dtype), numpy.zeros(({n}, {n}), a.dtype)",
        f"size, order = numpy.abs(a[0, :{n}]), numpy.arange({n})",
        *_scaling(n),
        *_factorisation(n, DEPENDENT[dtype]),
        *_substitution(n),
        *_of_least_norm(n),
        "z = numpy.empty_like(x)",
        f"for k in range({n}):",
        "    z[order[k]] = x[k] / size[order[k]]",
        f"return {pack(f'z[{i}]' for i in range(n))}, pivot + total",
    )


def _scaling(n: int) -> list[str]:
    """Lines that scale the rows of a, then the columns by ``size``; ``total`` becomes NaN where A is not finite."""
    N = f"range({n})"
    return [
        "total = 0.0 * size[0]",
        f"for i in {N}:",
        "    most = 0.0 * total",
        f"    for j in {N}:",
        "        most = max(most, abs(a[i, j]))",
        "        total += 0.0 * abs(a[i, j])",
        "    if most > 0.0:",
        f"        for j in range({n + 1}):",
        "            a[i, j] = a[i, j] / most",
        f"for j in {N}:",
        "    size[j] = 0.0",
        f"    for i in {N}:",
        "        size[j] = max(size[j], abs(a[i, j]))",
        "    if not size[j] > 0.0:",
        "        size[j] = 1.0",
        f"    for i in {N}:",
        "        a[i, j] = a[i, j] / size[j]",
    ]


def _factorisation(n: int, dependent: float) -> list[str]:
    """Lines that find A P = Q R by modified Gram-Schmidt with column pivoting: Q in a, R in r, P in ``order``, and the rank."""
    N = f"range({n})"
    return [
        "rank, first, pivot = 0, 0.0 * total, 0.0 * total",
        f"for k in {N}:",
        "    best, most = k, 0.0 * total",
        f"    for j in range(k, {n}):",
        "        left = 0.0 * total",
        f"        for i in {N}:",
        "            left += abs(a[i, j]) * abs(a[i, j])",
        "        if left > most:",
        "            best, most = j, left",
        "    most = sqrt(most)",
        "    if k == 0:",
        "        first = most",
        f"    if not most > {dependent!r} * first:",
        "        break",
        "    rank, pivot = k + 1, most / first",
        "    if best != k:",
        "        order[k], order[best] = order[best], order[k]",
        f"        for i in {N}:",
        "            a[i, k], a[i, best] = a[i, best], a[i, k]",
        "            r[i, k], r[i, best] = r[i, best], r[i, k]",
        "    square = 0.0 * a[0, k]",
        f"    for i in {N}:",
        "        square += a[i, k] * a[i, k]",
        "    r[k, k] = sqrt(square)",
        f"    for i in {N}:",
        "        a[i, k] = a[i, k] / r[k, k]",
        f"    for j in range(k + 1, {n + 1}):",
        f"        for i in {N}:",
        "            r[k, j] += a[i, k] * a[i, j]",
        f"        for i in {N}:",
        "            a[i, j] -= r[k, j] * a[i, k]",
    ]


def _substitution(n: int) -> list[str]:
    """Lines that solve with the upper triangle of R, shape(rank, rank), for x; its other entries stay zero."""
    return [
        "for k in range(rank - 1, -1, -1):",
        f"    x[k] = r[k, {n}]",
        "    for j in range(k + 1, rank):",
        "        x[k] -= r[k, j] * x[j]",
        "    x[k] = x[k] / r[k, k]",
    ]


def _of_least_norm(n: int) -> list[str]:
    """Lines that find an orthogonal basis of the null space of R and subtract from x its components along it."""
    N = f"range({n})"
    return [
        f"for free in range(rank, {n}):",
        "    null[free, free] = 1.0",
        "    for k in range(rank - 1, -1, -1):",
        "        null[free, k] = -r[k, free]",
        "        for j in range(k + 1, rank):",
        "            null[free, k] -= r[k, j] * null[free, j]",
        "        null[free, k] = null[free, k] / r[k, k]",
        "    for other in range(rank, free + 1):",
        "        along, square = 0.0 * x[0], 0.0 * x[0]",
        f"        for j in {N}:",
        "            along += null[other, j] * null[free, j]",
        "            square += null[other, j] * null[other, j]",
        "        if other < free:",
        f"            for j in {N}:",
        "                null[free, j] -= along / square * null[other, j]",
        "    along, square = 0.0 * x[0], 0.0 * x[0]",
        f"    for j in {N}:",
        "        along += null[free, j] * x[j]",
        "        square += null[free, j] * null[free, j]",
        f"    for j in {N}:",
        "        x[j] -= along / square * null[free, j]",
    ]
