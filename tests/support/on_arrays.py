"""Functions of an array and its length, of which machine code is made."""

import numpy

T = numpy.array([[0, 2], [1, 0]])


def put(a, k):
    a[k] = 5.0
    return True


def entries(a, n):
    s = 0.0
    for k in range(n):
        s += a[k]
    return s


def a_test_before_an_entry(a, n):
    k = 0
    while k < n and a[k] < 2.0:
        k += 1
    return k, (a[k] if k < n else -1.0)


def a_new_array(a, n):
    b = numpy.empty(n)
    for k in range(n):
        b[k] = 2.0 * a[n - 1 - k]
    return b


def an_array_that_is_carried(a, n):
    for turn in range(3):
        b = numpy.zeros(n)
        for k in range(n):
            b[k] = a[(k + 1) % n] + turn
        a = b
    return a


def arrays_that_are_exchanged(a, n):
    b = 2.0 * a
    for _ in range(5):
        a, b = b, a
        c = a + b
        b = c - 1.0
    return a, b


def parts(a, n):
    b = numpy.zeros((n, 3))
    b[:, 1] = a
    b[0] = 7.0
    c = b[1:, :].T
    return c, b[n - 1, 1], b[-1, 0]


def a_copy(a, n):
    b = a.copy()
    b[0] = -1.0
    return a, b, len(a)


def a_table(a, n):
    s = 0.0
    for k in range(2):
        s += a[T[k, 1]] - 0.5 * a[T[k, 0]]
    return s


def an_array_of_one_branch(a, n):
    b = a
    if a[0] > 0.0:
        b = -a
    return b


def what_is_stored_by_a_test(a, n):
    b = a.copy()
    if a[0] > 0.0 and put(b, 1):
        b[2] = 6.0
    return b
