"""A reader sees the old file or the new one, never half of one."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from bayes_hw.errors import InputError
from bayes_hw.files import (
    check_output_file,
    check_output_folder,
    read_json,
    read_small_text,
    staged,
    temporary_sibling,
    write_bytes_atomically,
    write_json,
    write_text_atomically,
)


def test_content_lands_whole_in_a_new_folder(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "x.json"
    write_text_atomically(path, "größe\n")
    assert path.read_bytes() == "größe\n".encode()
    write_bytes_atomically(path, b"\x00\x01")
    assert path.read_bytes() == b"\x00\x01"
    assert [entry.name for entry in path.parent.iterdir()] == ["x.json"]


def test_an_error_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), temporary_sibling(path) as temporary:
        temporary.write_text("half")
        assert temporary.parent == path.parent and temporary.suffix == ".csv"
        assert path.read_text() == "old"
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.csv"]


def test_permissions_are_those_of_an_ordinary_new_file(tmp_path: Path) -> None:
    """Not those of a private temporary file: others may read a report."""
    (tmp_path / "ordinary").write_text("")
    write_text_atomically(tmp_path / "atomic", "")
    assert (tmp_path / "atomic").stat().st_mode == (tmp_path / "ordinary").stat().st_mode
    mask = os.umask(0o022)
    os.umask(mask)
    assert (tmp_path / "atomic").stat().st_mode & mask == 0


def test_a_folder_that_is_a_file_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written") as caught:
        write_text_atomically(tmp_path / "file" / "x.json", "")
    assert "\n" not in str(caught.value) and "--out" in str(caught.value)


def test_a_target_that_is_a_folder_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "x.json").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        write_text_atomically(tmp_path / "x.json", "")
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.json"]


def test_a_long_name_is_no_obstacle(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 240 + ".json")
    write_text_atomically(path, "1")
    assert path.read_text() == "1"


def test_settings_are_read_within_bounds(tmp_path: Path) -> None:
    """No device, no folder, no gigabytes: a model given as /dev/zero is refused at once."""
    path = tmp_path / "x.json"
    path.write_text("größe", encoding="utf-8")
    assert read_small_text(path) == "größe"
    for other in (tmp_path, Path("/dev/zero")):
        with pytest.raises(InputError, match="is not a regular file"):
            read_small_text(other)
    with path.open("wb") as stream:
        stream.truncate(2**34)
    with pytest.raises(InputError, match="is larger than 16 MB"):
        read_small_text(path)


def test_a_full_disk_is_named_with_its_file(tmp_path: Path) -> None:
    with (
        pytest.raises(OSError, match="No space left on device") as caught,
        temporary_sibling(tmp_path / "x.csv"),
    ):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert caught.value.filename == str(tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_device_or_a_pipe_is_not_replaced(tmp_path: Path) -> None:
    """As root, a file renamed to it would be in the place of /dev/null."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for target in (pipe, Path(os.devnull)):
        with pytest.raises(InputError, match="no regular file"):
            write_text_atomically(target, "x")
        with pytest.raises(InputError, match="no regular file"):
            check_output_file(target, [])
    assert pipe.is_fifo() and Path(os.devnull).is_char_device()


def test_a_link_stays_and_its_file_is_written(tmp_path: Path) -> None:
    target, link = tmp_path / "there" / "x.csv", tmp_path / "x.csv"
    write_text_atomically(target, "old")
    link.symlink_to(target)
    write_text_atomically(link, "new")
    assert link.is_symlink() and target.read_text() == "new"


@pytest.mark.parametrize("name", ["a" * 300, "a\0b"])
def test_a_name_that_no_file_can_have_is_bad_input(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="give another --out"):
        check_output_folder(tmp_path / name)
    with pytest.raises(InputError, match="give another --out"):
        write_text_atomically(tmp_path / name, "x")


def test_files_of_one_run_come_together(tmp_path: Path) -> None:
    """What a run does not write again stays, unless it belongs to what the run stands for."""
    for name in ("a.txt", "stale.txt", "mine.txt"):
        (tmp_path / name).write_text("old")
    with staged(tmp_path, instead_of=["a.txt", "stale.txt", "absent.txt"]) as place:
        write_text_atomically(place / "a.txt", "new")
        write_text_atomically(place / "deep" / "b.txt", "new")
        assert (tmp_path / "a.txt").read_text() == "old"
    held = {str(path.relative_to(tmp_path)): path.read_text() for path in tmp_path.rglob("*.txt")}
    assert held == {"a.txt": "new", "deep/b.txt": "new", "mine.txt": "old"}
    assert {path.name for path in tmp_path.iterdir()} == {"a.txt", "deep", "mine.txt"}


def test_a_disk_that_fills_up_leaves_all_of_the_run_before(tmp_path: Path) -> None:
    """The second file finds no room: neither is replaced, and the file is named as the user knows it."""
    for name in ("a.txt", "b.txt"):
        (tmp_path / name).write_text("old")
    with pytest.raises(OSError, match=r"No space") as caught, staged(tmp_path, ["b.txt"]) as place:
        write_text_atomically(place / "a.txt", "new")
        raise OSError(errno.ENOSPC, "No space left on device", str(place / "b.txt"))
    assert caught.value.filename == str(tmp_path / "b.txt")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "old", "b.txt": "old"}


def test_a_target_that_is_no_file_stops_all(tmp_path: Path) -> None:
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(InputError, match=r"b.txt: is a folder"), staged(tmp_path) as place:
        write_text_atomically(place / "a.txt", "new")
        write_text_atomically(place / "b.txt", "new")
    assert {path.name for path in tmp_path.iterdir()} == {"b.txt"}


def test_a_file_reached_by_a_link_to_another_disk_is_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = tmp_path / "elsewhere.txt"
    real.write_text("old")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a.txt").symlink_to(real)
    rename = Path.replace

    def replace(path: Path, target: Path) -> Path:
        if ".staged." in str(path) and ".staged." not in str(target):
            raise OSError(errno.EXDEV, "Invalid cross-device link")
        return rename(path, target)

    monkeypatch.setattr(Path, "replace", replace)
    with staged(tmp_path / "out") as place:
        write_text_atomically(place / "a.txt", "new")
    assert real.read_text() == "new"
    assert (tmp_path / "out" / "a.txt").is_symlink()


def test_json_is_read_back_and_holds_no_number_that_is_none(tmp_path: Path) -> None:
    """What cannot be written leaves the file as it was; what cannot be read says what to do."""
    path = tmp_path / "a.json"
    write_json(path, {"x": [1.5, None, "é"]})
    assert read_json(path) == {"x": [1.5, None, "é"]}
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(path, {"x": float("nan")})
    assert read_json(path) == {"x": [1.5, None, "é"]}
    path.write_text("{")
    with pytest.raises(InputError, match=r"a\.json: is not JSON .*; give another"):
        read_json(path, "give another")
    with pytest.raises(InputError, match=r"b\.json: cannot be read .*; give a JSON file"):
        read_json(tmp_path / "b.json")
