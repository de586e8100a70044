from hypothesis import given
from hypothesis import strategies as st

from softslip.messages import enumerated


@given(st.lists(st.text("abc", min_size=1)), st.integers(1, 5))
def test_names_are_named_or_counted(names, most):
    told, _, more = enumerated(names, most).partition(" and ")
    assert told == ", ".join(names[:most])
    assert more == (f"{len(names) - most} more" if len(names) > most else "")
