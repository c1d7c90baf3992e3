"""Numbers of a document cross the border to JSON and back with every bit, and nothing else passes for a number."""

from __future__ import annotations

import math
import pickle
import struct

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spook_tracker.tracker.document.json_form import NAN, Number, boxed, decode, encode, readable
from spook_tracker.tracker.document.run_document import Curve


@given(st.lists(st.floats(), max_size=5))
def test_every_float_comes_back_with_its_bits(values: list[float]) -> None:
    line = Curve(name="c", x=(), y=tuple(map(Number, values)), style="line")
    for text in (encode(line), readable(line)):
        back = decode(text, Curve)
        assert back == line
        for value, found in zip(values, back.y, strict=True):
            same = math.isnan(value) and math.isnan(found)
            assert same or struct.pack("d", value) == struct.pack("d", found)


def test_equal_documents_are_equal_though_they_hold_nan() -> None:
    line = Curve(name="c", x=(NAN,), y=(Number(-math.nan),), style="line")

    assert line == Curve(name="c", x=(Number("nan"),), y=(NAN,), style="line")
    assert pickle.loads(pickle.dumps(line)) == line


def test_many_numbers_are_read_at_once_and_stay_what_they_are() -> None:
    back = decode('{"name": "c", "x": [1.5, -0.0], "y": [2, "nan", "-inf"], "style": "line"}', Curve)

    assert back == Curve(name="c", x=(1.5, -0.0), y=(2.0, NAN, -math.inf), style="line")
    assert math.copysign(1.0, back.x[1]) == -1.0
    assert [type(value) for value in (*back.x, *back.y)] == [float, float, Number, Number, Number]
    assert encode(back) == b'{"name":"c","x":[1.5,-0.0],"y":[2.0,"nan","-inf"],"style":"line"}'
    assert pickle.loads(pickle.dumps(back)) == back
    with pytest.raises(msgspec.DecodeError):
        decode('{"name": "c", "x": 1.5, "y": [], "style": "line"}', Curve)


@pytest.mark.parametrize(
    "told", ["null", "true", '"1.5"', '"infinity"', '"NaN"', "[]", "{}", "1e999", "1" + "0" * 400]
)
def test_what_is_no_number_is_refused(told: str) -> None:
    with pytest.raises(msgspec.DecodeError):
        decode(f'{{"name": "c", "x": [{told}], "y": [], "style": "line"}}', Curve)


@pytest.mark.parametrize(
    ("number", "told"), [(math.nan, "nan"), (math.inf, "inf"), (-math.inf, "-inf"), (-0.0, -0.0)]
)
def test_json_has_words_for_what_is_not_finite(number: float, told: float | str) -> None:
    assert boxed(number) == told
    assert str(boxed(number)) == str(told)


def test_what_has_no_place_in_a_document_is_named() -> None:
    with pytest.raises(TypeError, match="a complex cannot be part of a document"):
        encode({"value": 1j})
