"""Functions of two numbers, of which machine code is made: branches, loops, tuples, tests."""

from math import cos, exp, log, sin, sqrt, tan


def off(x):
    return 1.0 / x


def half(x):
    return x / 2.0


def least(x, y):
    if x < y:
        return x
    return y


def a_branch(x, y):
    if x > y:
        return x - y
    return y - 2.0 * x


def a_branch_that_binds(x, y):
    z = 1.0
    if x > 0.0:
        z = x
    else:
        z, y = y, z
    return z, y


def a_choice(x, y):
    return (x if x > y else -y), (1 if x > 0.0 else 0)


def min_and_max(x, y):
    return min(x, y, 0.5), max(x, y), min((x, y)), abs(x)


def truth(x, y):
    return x > 0.0 and y > 0.0, x > 0.0 or not y > 0.0, 0.0 < x < y, bool(x != y)


def both_in_turn(x, y):
    return bool(x != 0.0 and off(x) > y), bool(x == 0.0 or off(x) > y)


def a_sum_in_a_loop(x, y):
    s = 0.0
    for k in range(1, 20, 3):
        s += x / k - y
    return s


def a_loop_downwards(x, y):
    s = 0.0
    for k in range(9, 2, -2):
        s = x * s + k
    return s


def no_turn(x, y):
    for _ in range(3, 3):
        x = y
    return x


def a_return_from_a_loop(x, y):
    for k in range(50):
        x = 0.5 * x + y
        if abs(x) < 0.3:
            return x, k
    return x, -1


def a_break(x, y):
    n = 0
    for k in range(30):
        x = x * 0.7
        if x < 0.1:
            break
        n = k
    return x, n


def a_turn_cut_short(x, y):
    s = 0.0
    for k in range(12):
        if k % 3 == 1:
            continue
        s = s + x * k
        y = s
    return s, y


def a_while(x, y):
    n = 0
    while abs(x) > 0.01 and n < 100:
        x = x / 2.0
        n += 1
    return x, n


def nested_loops(x, y):
    n = 0
    for i in range(6):
        for j in range(i, 6):
            if x * i > j:
                break
            n += 1
            x = x + 0.01 * j
    return n, x


def an_integer_that_becomes_a_float(x, y):
    s = 0
    for _ in range(5):
        s = s + x
    return s


def a_name_bound_in_a_loop(x, y):
    for k in range(4):
        last = x * k
    return last


def a_name_bound_in_the_first_turn(x, y):
    for k in range(4):
        if k == 0:  # noqa: SIM108
            pair = (x, y)
        else:
            pair = (pair[1], pair[0] + 1.0)
    return pair


def a_pair_that_is_exchanged(x, y):
    a = (x, 1.0)
    b = (y, 2.0)
    for _ in range(5):
        if a[0] > b[0]:
            a, b = b, a
        a = (a[0] + 0.3, a[1])
    return a, b


def a_loop_over_a_tuple(x, y):
    s = 0.0
    for z in (x, y, 2.0):
        s = z - s
    return s


def nothing(x, y):
    memory = ()
    for _ in range(3):
        x, memory = x + 1.0, memory
    return x, memory


def functions(x, y):
    return least(half(x), y), least(y, half(half(x)))


def early_returns_nested(x, y):
    for i in range(3):
        if x > 1.0:
            for j in range(3):
                x = x - 1.0
                if x < y:
                    return i, j, x
        else:
            x = x + 0.75
    return 7, 7, x


def zero_of_either_sign(x, y):
    z = -0.0
    if x > y:
        z = 0.0
    return z, -z, z * y


def powers(x, y):
    return x**2, x**3, (1.0 + y * y) ** -2, x**5


def functions_of_numbers(x, y):
    return sqrt(x * x), sin(x), cos(x) * sin(y), exp(-x * x), log(1.0 + y * y), tan(x)


def tests_of_whole_numbers(x, y):
    n = int(4.0 * abs(x))
    return n // 2, n % 2, float(n) / 3, -n, abs(n - 3)
