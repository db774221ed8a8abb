import numpy as np
import pytest

from bayes_hw.errors import InputError
from bayes_hw.report.page.document import Figure, Table, ZoomableRecord


def test_table_refuses_a_row_of_another_length():
    with pytest.raises(InputError, match="row 1 has 1 cells, the header 2"):
        Table(("a", "b"), (("1", "2"), ("3",)), "caption")


def test_zoomable_record_refuses_arrays_of_different_length():
    t = np.arange(3.0)
    with pytest.raises(InputError, match="equally long"):
        ZoomableRecord(t, t, t[:2], t, t, "s", "deg", "band", Figure("<svg/>", "", ""), "")
