"""Arrays of the same numbers in every form that numpy has, for hypothesis."""

import numpy
from hypothesis import strategies as st


def orders(draw, array):
    """The same numbers in another memory: order, strides, slices, alignment, byte order, read-only."""
    form = draw(st.sampled_from(["as is", "fortran", "sliced", "reversed", "transposed", "unaligned", "swapped", "list"]))
    if form == "fortran":
        array = numpy.asfortranarray(array)
    elif form == "sliced":
        room = numpy.zeros((2 * len(array) + 1,) + tuple(n + 2 for n in array.shape[1:]), array.dtype)
        inner = room[(slice(1, None, 2),) + tuple(slice(1, n + 1) for n in array.shape[1:])]
        inner[...] = array
        array = inner
    elif form == "reversed":
        array = numpy.ascontiguousarray(array[::-1])[::-1]
    elif form == "transposed":
        array = numpy.ascontiguousarray(array.T).T
    elif form == "unaligned" and array.dtype.kind != "O":
        room = numpy.zeros(array.nbytes + 1, "u1")
        other = room[1:].view(array.dtype).reshape(array.shape)
        other[...] = array
        array = other
    elif form == "swapped":
        array = array.astype(array.dtype.newbyteorder())
    elif form == "list":
        return array.tolist()
    if draw(st.booleans()):
        array.flags.writeable = False
    return array


@st.composite
def forms_of(draw, array, dtypes):
    """`array` in one of these dtypes, which hold its numbers exactly, and in any form."""
    return orders(draw, array.astype(draw(st.sampled_from(dtypes))))


@st.composite
def strange_things(draw, count):
    """What may be given for points and is mostly wrong."""
    shape = draw(st.sampled_from([(count, 3), (3 * count,), (count, 2), (0,), (0, 3), (count - 1, 3), (count, 3, 3), (), (3, count)]))
    dtype = draw(st.sampled_from("? i1 u2 i4 i8 u8 f2 f4 f8 g c8 c16 O U3 S2 M8[s] m8[s] V4".split()))
    fill = draw(st.sampled_from([0, 1, 255, 1e39, -1e300, float("nan"), float("inf"), None, "x"]))
    with numpy.errstate(all="ignore"):
        try:
            array = numpy.full(shape, fill, dtype)
        except (ValueError, OverflowError, TypeError):
            array = numpy.zeros(shape, dtype)
    if array.ndim and draw(st.booleans()):
        return orders(draw, array)
    return draw(st.sampled_from([array, None, "points", 5, b"\0" * 36, [[1, 2], [3]], {1: 2}, object()]) if draw(st.booleans()) else st.just(array))
