import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softslip.analysis.explorer.embedding import TYPES, embedded, restored


@given(st.lists(st.floats()))
def test_numbers_come_back_to_the_last_bit(values):
    text = json.dumps(embedded(np.array(values, dtype=float)))
    back = restored(json.loads(text))
    assert back.tobytes() == np.array(values, dtype="<f8").tobytes()


@pytest.mark.parametrize("kind", [kind for kind in TYPES if kind != "f8"])
def test_numbers_that_a_type_cannot_hold_are_refused(kind):
    most = np.iinfo(TYPES[kind]).max
    assert restored(embedded([0, most], kind)).tolist() == [0, most]
    for number in (-1, most + 1, 0.5):
        with pytest.raises(ValueError, match=f"do not fit into {kind}"):
            embedded([0, number], kind)
