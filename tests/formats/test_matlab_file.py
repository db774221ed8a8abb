"""MATLAB files: agreement with scipy on good ones, one line and little memory on bad ones."""

import struct
import tracemalloc
import zlib

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bayes_hw.errors import InputError
from bayes_hw.formats.hdf5_file import read_hdf5
from bayes_hw.formats.matlab_file import MOST_BYTES, read_matlab

MATRIX, COMPRESSED, DOUBLE, INT8, INT32, UINT32 = 14, 15, 9, 1, 5, 6

files_from_hypothesis = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def element(kind: int, data: bytes, size: int | None = None, order: str = "<") -> bytes:
    padding = b"\0" * (-len(data) % 8)
    return struct.pack(f"{order}II", kind, len(data) if size is None else size) + data + padding


def matrix(name, data, dimensions=None, class_code=6, flags=0, size=None, order="<") -> bytes:
    """The content of a matrix element holding doubles, with any head."""
    dimensions = dimensions or (len(data) // 8, 1)
    return (
        element(UINT32, struct.pack(f"{order}II", class_code | flags, 0), order=order)
        + element(INT32, struct.pack(f"{order}{len(dimensions)}i", *dimensions), order=order)
        + element(INT8, name, order=order)
        + element(DOUBLE, data, size, order=order)
    )


def header(order: str = "<", version: int = 0x0100) -> bytes:
    mark = b"IM" if order == "<" else b"MI"
    return b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(f"{order}H", version) + mark


def deflated(content: bytes, order: str = "<") -> bytes:
    data = zlib.compress(content, 9)
    return struct.pack(f"{order}II", COMPRESSED, len(data)) + data


def refusal(path, wanted=("u",)) -> str:
    with pytest.raises(InputError) as caught:
        read_matlab(path, wanted, most_rows=1000)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


number_types = st.sampled_from(["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"])


@files_from_hypothesis
@given(
    values=st.lists(st.integers(0, 127), min_size=2, max_size=50),
    number_type=number_types,
    compressed=st.booleans(),
    upright=st.sampled_from(["column", "row"]),
)
def test_vectors_of_every_number_type_are_read_as_scipy_wrote_them(
    tmp_path, values, number_type, compressed, upright
):
    path = tmp_path / "a.mat"
    vector = np.array(values, dtype=number_type)
    content = {"u": vector, "exp": {"y": vector[::-1], "deep": {"t": vector}}, "label": "text"}
    scipy.io.savemat(path, content, do_compression=compressed, oned_as=upright)
    table = read_matlab(path, ["u", "exp.y", "exp.deep.t"], most_rows=1000)
    for name, expected in (("u", values), ("exp.y", values[::-1]), ("exp.deep.t", values)):
        assert table.values[name].dtype == np.float64
        np.testing.assert_array_equal(table.values[name], expected)
    assert table.missing == ()
    assert table.place(4) == "sample 5"


def test_big_endian_files_are_read(tmp_path):
    path = tmp_path / "a.mat"
    data = np.arange(5, dtype=">f8").tobytes()
    path.write_bytes(header(">") + element(MATRIX, matrix(b"u", data, order=">"), order=">"))
    assert scipy.io.loadmat(path)["u"].ravel().tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(read_matlab(path, ["u"], most_rows=9).values["u"], np.arange(5))


def test_no_more_than_most_rows_are_kept(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"u": np.arange(50.0)})
    np.testing.assert_array_equal(read_matlab(path, ["u"], most_rows=7).values["u"], np.arange(7))


def test_missing_variables_and_fields_are_reported_with_what_there_is(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"t": np.arange(9.0), "exp": {"a": 1.0, "b": 2.0}, "other": {"c": 1.0}})
    table = read_matlab(path, ["t", "exp.u", "y", "t.u"], most_rows=9)
    assert table.missing == ("exp.u", "y", "t.u")
    assert table.names == ("t", "exp.a", "exp.b", "other.FIELD")


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        (np.zeros((3, 4)), "is 3 x 4; name a vector"),
        (np.array([1 + 1j, 2]), "complex numbers"),
        ("text", "holds text"),
        (np.array([1, "a"], dtype=object), "holds a cell array"),
        ({"a": 1.0}, "holds a structure"),
        (scipy.sparse.eye_array(4).tocsc(), "holds a sparse matrix"),
        (np.array([1.0, -np.inf]), "sample 2: -inf is not a finite number"),
    ],
)
def test_a_variable_that_is_no_finite_real_vector_is_refused(tmp_path, value, complaint):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"u": value})
    message = refusal(path)
    assert message.startswith("variable 'u'")
    assert complaint in message


@pytest.mark.parametrize(("class_code", "held"), [(3, "an object"), (16, "a function"), (17, "an obj")])
def test_objects_and_functions_are_never_decoded(tmp_path, class_code, held):
    path = tmp_path / "a.mat"
    path.write_bytes(header() + element(MATRIX, matrix(b"u", bytes(80), class_code=class_code)))
    assert f"holds {held}" in refusal(path)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "not a MATLAB file of version 5 to 7"),
        (b"t,u,y\n" * 100, "not a MATLAB file of version 5 to 7"),
        (header(version=0x0300), "not a MATLAB file of version 5 to 7"),
        (b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF", "version 7.3; save it with save"),
        (b"\x89HDF\r\n\x1a\n" + bytes(600), "version 7.3; save it with save"),
        (header() + struct.pack("<II", MATRIX, 2**31), "damaged"),
        (header() + struct.pack("<II", 77, 8) + bytes(8), "damaged"),
        (header() + element(MATRIX, b""), "damaged"),
        (header() + element(MATRIX, matrix(b"u", bytes(80), size=2**31)), "damaged"),
        (header() + element(MATRIX, matrix(b"u", bytes(80), (2**31 - 1, 1))), "damaged"),
        (header() + element(MATRIX, matrix(b"u", bytes(80), (-10, 1))), "damaged"),
        (header() + element(MATRIX, matrix(b"u", bytes(80), (1,) * 40)), "damaged"),
        (header() + element(COMPRESSED, b"not deflated"), "damaged"),
        (header() + deflated(element(MATRIX, matrix(b"u", bytes(4096)), 8000)), "damaged"),
        (header() + 2 * element(MATRIX, matrix(b"u", bytes(80))), "'u' twice"),
        (header() + 10_001 * element(MATRIX, matrix(b"v", b"")), "more than 10000 variables"),
    ],
)
def test_a_file_that_is_not_sound_is_refused_with_the_reason(tmp_path, content, complaint):
    path = tmp_path / "a.mat"
    path.write_bytes(content)
    assert complaint in refusal(path)


def bomb(name: bytes, size: int, declared: int) -> bytes:
    """A compressed variable of `size` zero bytes whose tag declares `declared` bytes of data."""
    head = matrix(name, b"", (declared // 8, 1), size=declared)
    deflater = zlib.compressobj(9)
    data = deflater.compress(struct.pack("<II", MATRIX, len(head) + declared) + head)
    zeros = bytes(2**20)
    data += b"".join(deflater.compress(zeros) for _ in range(size // 2**20)) + deflater.flush()
    return struct.pack("<II", COMPRESSED, len(data)) + data


@pytest.mark.parametrize(
    ("size", "declared", "complaint"),
    [
        (2**27, 2**29, "more than the 256 MB that are read"),
        (2**27, 80, ""),
        (2**20, MOST_BYTES // 2, "damaged"),
    ],
)
def test_a_bomb_is_inflated_no_further_than_its_tag_declares(tmp_path, size, declared, complaint):
    path = tmp_path / "a.mat"
    path.write_bytes(header() + bomb(b"u", size, declared))
    tracemalloc.start()
    try:
        if complaint:
            assert complaint in refusal(path)
        else:
            assert len(read_matlab(path, ["u"], most_rows=1000).values["u"]) == declared // 8
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2**24


def test_a_bomb_that_is_not_asked_for_is_not_inflated(tmp_path):
    path = tmp_path / "a.mat"
    sound = element(MATRIX, matrix(b"u", np.arange(40.0).tobytes()))
    path.write_bytes(header() + bomb(b"other", 2**26, 2**26) + sound)
    tracemalloc.start()
    try:
        table = read_matlab(path, ["u"], most_rows=1000)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    np.testing.assert_array_equal(table.values["u"], np.arange(40.0))
    assert peak < 2**20


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "compressed"])
def sound_bytes(request, tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("matlab") / "a.mat"
    content = {"t": np.arange(20.0), "u": np.arange(20.0), "exp": {"y": np.arange(20.0)}}
    scipy.io.savemat(path, content, do_compression=request.param)
    return path.read_bytes()


@files_from_hypothesis
@given(data=st.data())
def test_changed_bytes_are_a_table_or_refused(tmp_path, sound_bytes, data):
    changed = bytearray(sound_bytes)
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(124, len(changed) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / "a.mat"
    path.write_bytes(bytes(changed[: data.draw(st.integers(0, len(changed)))]))
    try:
        read_matlab(path, ["t", "u", "exp.y"], most_rows=1000)
    except InputError as error:
        assert "\n" not in str(error)


@files_from_hypothesis
@given(tail=st.binary(max_size=200))
def test_random_bytes_after_a_good_header_are_a_table_or_refused(tmp_path, tail):
    path = tmp_path / "a.mat"
    path.write_bytes(header() + tail)
    try:
        read_matlab(path, ["u"], most_rows=1000)
    except InputError as error:
        assert "\n" not in str(error)


def timetable(name: bytes = b"log", class_name: bytes = b"timetable") -> bytes:
    """A variable of a newer class: flags, name, kind, class, and references to what is stored elsewhere."""
    references = matrix(b"", struct.pack("<6d", 0xDD000000, 2, 1, 1, 1, 1), (6, 1))
    return (
        element(UINT32, struct.pack("<II", 17, 0))
        + element(INT8, name)
        + element(INT8, b"MCOS")
        + element(INT8, class_name)
        + element(MATRIX, references)
    )


EXTRA = "; pip install 'bayes-hw[matlab]' to read it"
ALONE = ", which MATLAB alone can read"


@pytest.mark.parametrize("pack", [lambda content: element(MATRIX, content), None])
@pytest.mark.parametrize(
    ("class_name", "remedy"),
    [
        (b"timetable", f"{EXTRA}, or type writetimetable(log, 'night.csv') in MATLAB and give night.csv"),
        (b"table", f"{EXTRA}, or type writetable(log, 'night.csv') in MATLAB and give night.csv"),
        (b"datetime", f"{ALONE}; type t = posixtime(log) there and save t beside the other signals"),
        (b"containers.Map", f"{ALONE}; save its numbers as vectors: t, u, y"),
    ],
)
def test_a_timetable_is_named_with_what_to_type_in_matlab(tmp_path, pack, class_name, remedy):
    content = timetable(class_name=class_name)
    path = tmp_path / "night.mat"
    path.write_bytes(header() + (pack(content) if pack else deflated(element(MATRIX, content))))
    said = refusal(path)
    assert said == f"variable 'log' is a MATLAB {class_name.decode()}{remedy}"
    assert refusal(path, ("log",)) == said
    with pytest.raises(InputError, match="is a MATLAB"):
        read_matlab(path, (), most_rows=10)


def test_vectors_beside_a_timetable_are_read(tmp_path):
    path = tmp_path / "night.mat"
    vector = element(MATRIX, matrix(b"u", struct.pack("<3d", 1, 2, 3)))
    path.write_bytes(header() + element(MATRIX, timetable()) + vector)
    np.testing.assert_array_equal(read_matlab(path, ("u",), most_rows=10).values["u"], [1, 2, 3])
    assert "writetimetable(log" in refusal(path, ("u", "y"))


def test_a_timetable_of_version_7_3_is_named_too(tmp_path):
    import h5py

    path = tmp_path / "night.mat"
    with h5py.File(path, "w") as file:
        references = file.create_dataset("log", data=np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype="u4"))
        references.attrs["MATLAB_class"] = np.bytes_(b"timetable")
        references.attrs["MATLAB_object_decode"] = np.int32(3)
        file["u"] = np.arange(3.0)
    with pytest.raises(InputError, match=r"writetimetable\(log, 'night.csv'\) in MATLAB and give night.csv"):
        read_hdf5(path, ("u", "y"), most_rows=10)
    assert len(read_hdf5(path, ("u",), most_rows=10).values["u"]) == 3
