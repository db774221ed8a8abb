"""Bags give no more than is read: a message, all messages, and what they inflate to are bounded."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from own_process import run_python

from bayes_hw.errors import InputError
from bayes_hw.formats import bag_file
from bayes_hw.formats.bag_file import read_bag
from bayes_hw.record import Columns, Record

rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")
zstd = pytest.importorskip("backports.zstd")

STORE = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
Float64 = STORE.types["std_msgs/msg/Float64"]
ByteMultiArray = STORE.types["std_msgs/msg/UInt8MultiArray"]
Layout = STORE.types["std_msgs/msg/MultiArrayLayout"]
Header = STORE.types["std_msgs/msg/Header"]
Time = STORE.types["builtin_interfaces/msg/Time"]
Vector3 = STORE.types["geometry_msgs/msg/Vector3"]
Vector3Stamped = STORE.types["geometry_msgs/msg/Vector3Stamped"]


def bag(folder: Path, messages: int, image_bytes: int = 0, compressed: bool = False) -> Path:
    """`/cmd` with numbers 0, 1, ...; `/image` with zeros where there are bytes of it."""
    writer = rosbag2.Writer(folder, version=9)
    if compressed:
        writer.set_compression(rosbag2.CompressionMode.MESSAGE, rosbag2.CompressionFormat.ZSTD)
    with writer:
        cmd = writer.add_connection("/cmd", Float64.__msgtype__, typestore=STORE)
        for k in range(messages):
            data = STORE.serialize_cdr(Float64(float(k)), Float64.__msgtype__)
            writer.write(cmd, 1_000_000_000 + 50_000_000 * k, data)
        if image_bytes:
            image = writer.add_connection("/image", ByteMultiArray.__msgtype__, typestore=STORE)
            content = ByteMultiArray(Layout([], 0), np.zeros(image_bytes, dtype=np.uint8))
            writer.write(image, 1_000_000_000, STORE.serialize_cdr(content, ByteMultiArray.__msgtype__))
    return folder


def test_a_record_comes_out_of_an_mcap_file(tmp_path: Path) -> None:
    """Command and angle with headers and clocks of their own, the second twice as often; as a log of ROS 2
    has them."""
    u = 0.5 * np.sin(0.9 * np.arange(400) / 20)
    y = np.cumsum(np.repeat(u, 2)) / 40
    start_ns = 1_773_528_067 * 10**9
    mcap = rosbag2.StoragePlugin.MCAP
    with rosbag2.Writer(tmp_path / "night", version=9, storage_plugin=mcap) as writer:
        topics = {
            topic: writer.add_connection(topic, Vector3Stamped.__msgtype__, typestore=STORE)
            for topic in ("/axis/command", "/axis/state")
        }
        for topic, values, step_ns in (
            ("/axis/command", u, 50_000_000),
            ("/axis/state", y, 25_000_000),
        ):
            for k, value in enumerate(values):
                stamp = start_ns + k * step_ns
                header = Header(Time(stamp // 10**9, stamp % 10**9), "axis")
                message = Vector3Stamped(header, Vector3(float(value), 0.0, 0.0))
                data = STORE.serialize_cdr(message, Vector3Stamped.__msgtype__)
                writer.write(topics[topic], stamp + 3_000_000, data)
    (path,) = (tmp_path / "night").glob("*.mcap")
    columns = Columns(time="t", input="/axis/command.vector.x", output="/axis/state.vector.x")
    record = Record.read(path, columns=columns)
    assert record.sample_rate_hz == pytest.approx(20)
    np.testing.assert_allclose(record.u, u, rtol=1e-12)
    np.testing.assert_allclose(record.y, y[::2], rtol=1e-12)
    assert "no such field; they have vector.x" in refusal(path, "/axis/state.vector.w")


def refusal(path: Path, *wanted: str) -> str:
    with pytest.raises(InputError) as caught:
        read_bag(path, wanted, most_rows=1000)
    return str(caught.value)


@pytest.mark.parametrize("compressed", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_numbers_come_out_beside_a_topic_that_is_too_large(tmp_path: Path, compressed: bool) -> None:
    folder = bag(tmp_path / "bag", 40, 3 * 2**20, compressed)
    table = read_bag(folder, ["/cmd.data"], most_rows=1000)
    np.testing.assert_array_equal(table.values["/cmd.data"], np.arange(40.0))
    assert "'/image' has 3.0 MB, more than the 1 MB of a signal" in refusal(folder, "/image.data[0]")


def test_all_messages_together_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = bag(tmp_path / "bag", 40)
    size = len(STORE.serialize_cdr(Float64(0.0), Float64.__msgtype__))
    monkeypatch.setattr(bag_file, "MOST_BYTES", 40 * size)
    assert len(read_bag(folder, ["/cmd.data"], most_rows=1000).values["/cmd.data"]) == 40
    monkeypatch.setattr(bag_file, "MOST_BYTES", 40 * size - 1)
    assert "record a shorter bag" in refusal(folder, "/cmd.data")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited by what Linux counts")
def test_a_message_that_inflates_without_end_is_given_no_more_than_a_gigabyte(tmp_path: Path) -> None:
    """1.5 GB of zeros, some 50 kB compressed."""
    compressor, zeros = zstd.ZstdCompressor(), bytes(2**24)
    data = b"".join([compressor.compress(zeros) for _ in range(96)]) + compressor.flush()
    folder = tmp_path / "bomb"
    with rosbag2.Writer(folder, version=9) as writer:
        cmd = writer.add_connection("/cmd", Float64.__msgtype__, typestore=STORE)
        writer.write(cmd, 1_000_000_000, data)
    metadata = folder / "metadata.yaml"
    text = metadata.read_text()
    for line in ("compression_format: ''", "compression_mode: ''"):
        assert line in text
    text = text.replace("compression_format: ''", "compression_format: zstd")
    metadata.write_text(text.replace("compression_mode: ''", "compression_mode: message"))
    code = (
        "import resource, sys; from pathlib import Path; from bayes_hw.errors import InputError;"
        "from bayes_hw.formats.bag_file import read_bag\n"
        "try: read_bag(Path(sys.argv[1]), ['/cmd.data'], most_rows=99)\n"
        "except InputError as error: print('inflates' in str(error))\n"
        "print(max(resource.getrusage(who).ru_maxrss for who in (0, -1)))"
    )
    done = run_python("-c", code, folder, check=True)
    refused, kilobytes = done.stdout.split()
    assert refused == "True"
    assert int(kilobytes) * 1024 < 1e9
