"""Vectors of eight numbers against NumPy, number by number."""

import numba as nb
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from softslip.solver import lanes as module
from softslip.solver.compilation import compiled

moderate = arrays(np.float64, 8, elements=st.floats(-1e6, 1e6))
divisors = moderate.map(lambda values: np.where(np.abs(values) < 1e-6, 1.0, values))


@compiled
def store(value, out):
    """Write eight lanes."""
    module.put_eight(out, 0, value)


@compiled
def _arithmetic(a, b, c, out):
    x, y, z = module.eight(a, 0), module.eight(b, 0), module.eight(c, 0)
    store(x + y, out[0])
    store(x - y, out[1])
    store(x * y, out[2])
    store(x / y, out[3])
    store(module.multiply_add(x, y, z), out[4])
    store(2.0 * x + 1, out[5])
    store(module.nearest_integer(x), out[6])
    store(module.where(module.below(x, y), x, y), out[7])
    store(module.lesser(x, y), out[8])
    store(module.where(module.beyond(x, y), x, y), out[9])
    return module.how_many(module.below(x, y))


@given(
    moderate, moderate.map(lambda values: np.where(np.abs(values) < 1e-6, 1.0, values)), moderate
)
def test_arithmetic_is_that_of_eight_numbers(a, b, c):
    out = np.empty((10, 8))
    count = _arithmetic(a, b, c, out)
    exact = [a + b, a - b, a * b, a / b, None, 2 * a + 1, np.rint(a), np.minimum(a, b)]
    exact += [np.minimum(a, b), np.maximum(a, b)]
    for found, wanted in zip(out, exact, strict=True):
        if wanted is not None:
            assert np.array_equal(found, wanted)
    scale = np.abs(a * b) + np.abs(c)
    assert np.all(np.abs(out[4] - (a * b + c)) <= 4e-16 * scale)
    assert count == np.sum(a < b)


@compiled
def _parts(a, out):
    x = module.eight(a, 0)
    store(module.exponent_of(x), out[0])
    store(module.mantissa_of(x), out[1])


@given(arrays(np.float64, 8, elements=st.floats(1e-300, 1e300)))
def test_numbers_come_apart_into_mantissa_and_exponent(a):
    out = np.empty((2, 8))
    _parts(a, out)
    mantissa, exponent = np.frexp(a)
    assert np.array_equal(out[0], exponent - 1.0)
    assert np.array_equal(out[1], 2 * mantissa)


@compiled
def _loads(a, out):
    store(module.eight(a, 1), out[0])
    store(module.four_twice(a, 2), out[1])
    store(module.two_by_four(a, 3), out[2])
    store(module.equal(a[4]), out[3])


def test_numbers_are_loaded_where_they_are_wanted():
    out = np.empty((4, 8))
    _loads(np.arange(10.0), out)
    assert out[0].tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    assert out[1].tolist() == [2, 3, 4, 5, 2, 3, 4, 5]
    assert out[2].tolist() == [3, 3, 3, 3, 4, 4, 4, 4]
    assert out[3].tolist() == [4] * 8


@compiled
def _adds(a, four, two):
    x = module.eight(a, 0)
    module.add_four(four, 1, x)
    module.add_two(two, 1, x)


def test_sums_are_added_to_where_they_belong():
    four, two = np.ones(6), np.ones(4)
    _adds(np.array([1.0, 2, 3, 4, 10, 20, 30, 40]), four, two)
    assert four.tolist() == [1, 12, 23, 34, 45, 1]
    assert two.tolist() == [1, 11, 101, 1]


@compiled
def _lesser(a, b, out):
    store(module.lesser(module.eight(a, 0), module.eight(b, 0)), out)


@compiled
def _below(a, b):
    return module.how_many(module.below(module.eight(a, 0), module.eight(b, 0)))


def test_what_is_no_number_is_below_nothing():
    assert _below(np.full(8, np.nan), np.full(8, np.inf)) == 0
    assert _below(np.zeros(8), np.full(8, np.nan)) == 0
    out = np.empty(8)
    _lesser(np.full(8, np.nan), np.ones(8), out)
    assert out.tolist() == [1.0] * 8


@pytest.mark.skipif(
    "avx2" not in module.registers(), reason="vectors of this processor have no such name"
)
def test_the_compiler_keeps_lanes_in_registers():
    # Compiled here: what comes from the cache has no code to look at.
    options = {key: value for key, value in _arithmetic.targetoptions.items() if key != "cache"}
    fresh = nb.jit(**options)(_arithmetic.py_func)
    fresh(np.zeros(8), np.ones(8), np.ones(8), np.empty((10, 8)))
    code = "".join(fresh.inspect_asm().values())
    assert "vmulpd" in code
    assert ("zmm" in code) == ("avx512f" in module.registers())
