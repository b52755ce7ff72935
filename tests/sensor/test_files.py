# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import errno
import hashlib
import os
import re
import resource
import shutil
import stat
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sensor.errors import WedgeError
from sensor.files import (
    check_new_folder,
    check_outputs,
    new_file,
    new_folder,
    refuse_kept_folder,
    sha256_of_files,
    write_atomic,
)

OLD, NEW = b"old content", b"new content" * 10_000


@contextmanager
def full_disk(free_bytes=4096):
    """Writes stop after ``free_bytes`` of a file, as on a disk that fills half-way."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (free_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def failing(code):
    def fail(*_args, **_keywords):
        raise OSError(code, os.strerror(code))

    return fail


@given(st.binary(max_size=5000))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_written_is_there_and_nothing_else(tmp_path, content):
    path = tmp_path / "new" / "deep" / "file.bin"
    write_atomic(path, content)
    assert path.read_bytes() == content
    assert [entry.name for entry in path.parent.iterdir()] == ["file.bin"]


def test_a_disk_that_fills_half_way_leaves_the_old_file_and_no_trace(tmp_path):
    path = tmp_path / "file.bin"
    write_atomic(path, OLD)
    with (
        full_disk(),
        pytest.raises(WedgeError, match=r"file\.bin cannot be written: File too large"),
    ):
        write_atomic(path, NEW)
    assert path.read_bytes() == OLD
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EDQUOT])
def test_a_disk_that_fails_at_the_last_moment_leaves_the_old_file(tmp_path, monkeypatch, code):
    path = tmp_path / "file.bin"
    write_atomic(path, OLD)
    monkeypatch.setattr(os, "fsync", failing(code))
    with pytest.raises(WedgeError, match=os.strerror(code)):
        write_atomic(path, NEW)
    assert path.read_bytes() == OLD
    assert list(tmp_path.iterdir()) == [path]


def test_the_content_is_on_the_disk_before_the_name_is(tmp_path, monkeypatch):
    path = tmp_path / "file.bin"
    write_atomic(path, OLD)
    seen = []
    monkeypatch.setattr(os, "fsync", lambda _: seen.append(path.read_bytes()))
    write_atomic(path, NEW)
    assert seen == [OLD] and path.read_bytes() == NEW


def test_a_read_only_folder_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "open", failing(errno.EROFS))
    with pytest.raises(WedgeError, match=r"file\.bin cannot be written: Read-only file system"):
        write_atomic(tmp_path / "file.bin", NEW)
    assert not any(tmp_path.iterdir())


def test_a_folder_without_permission_is_a_sentence(tmp_path):
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        if os.access(tmp_path, os.W_OK):
            pytest.skip("this user may write everywhere")
        with pytest.raises(WedgeError, match="Permission denied"):
            write_atomic(tmp_path / "file.bin", NEW)
        with pytest.raises(WedgeError, match="Permission denied"), new_folder(tmp_path / "unit"):
            pass
    finally:
        tmp_path.chmod(stat.S_IRWXU)


def test_a_file_where_a_folder_should_be_and_the_reverse_are_sentences(tmp_path):
    (tmp_path / "file").write_bytes(OLD)
    (tmp_path / "folder").mkdir()
    with pytest.raises(WedgeError, match="file is not a folder that takes files"):
        write_atomic(tmp_path / "file" / "below.bin", NEW)
    with pytest.raises(WedgeError, match="cannot be written"):
        write_atomic(tmp_path / "folder", NEW)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "folder"]


def test_a_new_file_appears_when_it_is_complete(tmp_path):
    path = tmp_path / "file.bin"
    path.write_bytes(OLD)
    with new_file(path) as temporary:
        temporary.write_bytes(NEW)
        assert path.read_bytes() == OLD
    assert path.read_bytes() == NEW
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, WedgeError])
def test_a_file_whose_making_fails_leaves_the_old_one(tmp_path, error):
    path = tmp_path / "file.bin"
    path.write_bytes(OLD)
    with pytest.raises(error), new_file(path) as temporary:
        temporary.write_bytes(NEW)
        raise error
    assert path.read_bytes() == OLD
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("made", [new_file, new_folder])
def test_what_goes_wrong_is_told_of_the_name_that_was_asked_for(tmp_path, made):
    def fill(temporary):
        inside = temporary / "inside" if made is new_folder else temporary
        with full_disk():
            write_atomic(inside, NEW)

    with pytest.raises(WedgeError) as told, made(tmp_path / "asked") as temporary:
        fill(temporary)
    named = tmp_path / "asked" / "inside" if made is new_folder else tmp_path / "asked"
    assert str(told.value) == f"{named} cannot be written: File too large."


def test_a_new_folder_appears_when_it_is_complete(tmp_path):
    folder = tmp_path / "deep" / "unit"
    with new_folder(folder) as temporary:
        (temporary / "part").write_bytes(NEW)
        assert not folder.exists()
    assert (folder / "part").read_bytes() == NEW
    assert list(folder.parent.iterdir()) == [folder]


def test_an_empty_folder_is_filled(tmp_path):
    folder = tmp_path / "unit"
    folder.mkdir()
    with new_folder(folder) as temporary:
        (temporary / "part").write_bytes(NEW)
    assert [entry.name for entry in folder.iterdir()] == ["part"]
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, WedgeError])
def test_a_folder_whose_making_fails_never_appears(tmp_path, error):
    with pytest.raises(error), new_folder(tmp_path / "unit") as temporary:
        (temporary / "part").write_bytes(NEW)
        raise error
    assert not any(tmp_path.iterdir())


def test_a_disk_that_fills_while_a_folder_is_made_leaves_no_folder(tmp_path):
    with full_disk(), pytest.raises(WedgeError, match="File too large"):
        with new_folder(tmp_path / "unit") as temporary:
            write_atomic(temporary / "small", OLD)
            write_atomic(temporary / "large", NEW)
    assert not any(tmp_path.iterdir())
    with full_disk(), pytest.raises(WedgeError, match="unit cannot be written: File too large"):
        with new_folder(tmp_path / "unit") as temporary:
            (temporary / "large").write_bytes(NEW)
    assert not any(tmp_path.iterdir())


def test_a_folder_with_content_and_a_file_are_not_replaced(tmp_path):
    (tmp_path / "unit").mkdir()
    (tmp_path / "unit" / "kept").write_bytes(OLD)
    (tmp_path / "file").write_bytes(OLD)
    for name, why in (("unit", "already exists and is not empty"), ("file", "is a file: name a")):
        with pytest.raises(WedgeError, match=why):
            with new_folder(tmp_path / name):
                pytest.fail("the block must not run")
    assert (tmp_path / "unit" / "kept").read_bytes() == (tmp_path / "file").read_bytes() == OLD


def test_a_folder_of_an_earlier_run_is_replaced_once_the_new_one_is_whole(tmp_path):
    folder = tmp_path / "unit"
    for content in (OLD, NEW):
        with new_folder(folder, over="card") as temporary:
            (temporary / "card").write_bytes(content)
    assert (folder / "card").read_bytes() == NEW
    with pytest.raises(WedgeError), new_folder(folder, over="card"):
        raise WedgeError("the second half is missing.")
    assert (folder / "card").read_bytes() == NEW
    with pytest.raises(WedgeError, match="not empty"), new_folder(folder, over="other"):
        pytest.fail("the block must not run")
    assert list(tmp_path.iterdir()) == [folder]


def refused_before_the_work(folder, why):
    with pytest.raises(WedgeError, match=rf"^{folder} cannot be written: .*{why}.*\.$"):
        check_new_folder(folder)
    with pytest.raises(WedgeError, match=why), new_folder(folder):
        pytest.fail("the block must not run")


def test_a_mount_point_and_a_link_are_refused_before_the_work(tmp_path, monkeypatch):
    for name in ("mounted", "linked", "own"):
        (tmp_path / name).mkdir()
    (tmp_path / "link").symlink_to("linked")
    (tmp_path / "nowhere").symlink_to("none")
    is_mount = os.path.ismount
    monkeypatch.setattr(
        os.path, "ismount", lambda path: Path(path) == tmp_path / "mounted" or is_mount(path)
    )
    for name in ("mounted", "link", "nowhere"):
        refused_before_the_work(tmp_path / name, "link or a mount point")
        refuse_kept_folder(tmp_path / name)  # what is written in it, file by file, may be
    with new_folder(tmp_path / "mounted" / "unit"), new_folder(tmp_path / "link" / "unit"):
        pass
    check_new_folder(tmp_path / "own")
    assert (tmp_path / "mounted" / "unit").is_dir() and (tmp_path / "linked" / "unit").is_dir()


def test_a_folder_whose_place_takes_none_is_refused_before_the_work(tmp_path, monkeypatch):
    (tmp_path / "unit").mkdir()
    (tmp_path / "file").touch()
    refused_before_the_work(tmp_path / "file" / "deep" / "unit", "not a folder that takes files")
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: path != tmp_path and access(path, mode))
    for name in ("unit", "deep/unit"):
        refused_before_the_work(tmp_path / name, "not a folder that takes files")


def test_two_outputs_are_not_one_file():
    check_outputs(Path("a.json"), None, Path("b.json"))
    with pytest.raises(WedgeError, match=r"^unit/\.\./a\.json cannot be written: it is named"):
        check_outputs(Path("a.json"), None, Path("unit/../a.json"))


def test_an_output_in_a_folder_that_may_not_be_looked_into_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "stat", failing(errno.EACCES))
    with pytest.raises(WedgeError, match=r"a\.json cannot be written: Permission denied\.$"):
        check_outputs(tmp_path / "a.json")


def test_a_folder_that_holds_a_folder_of_the_name_is_not_replaced(tmp_path):
    kept = tmp_path / "unit" / "card" / "notes"
    kept.parent.mkdir(parents=True)
    kept.write_bytes(OLD)
    with pytest.raises(WedgeError, match="not empty"), new_folder(tmp_path / "unit", over="card"):
        pytest.fail("the block must not run")
    assert kept.read_bytes() == OLD


def the_whole_one_told_of(error):
    """The folder that a sentence names as what was made."""
    place = re.fullmatch(r".*; the complete result is in (.*): move it\.", str(error.value))
    return Path(place[1])


def test_what_came_while_a_folder_was_made_is_kept_and_so_is_what_was_made(tmp_path):
    folder = tmp_path / "unit"
    folder.mkdir()
    with pytest.raises(WedgeError, match="already exists and is not empty") as told:
        with new_folder(folder) as temporary:
            (temporary / "part").write_bytes(NEW)
            (folder / "notes").write_bytes(OLD)
    assert [entry.name for entry in folder.iterdir()] == ["notes"]
    made = the_whole_one_told_of(told)
    assert (made / "part").read_bytes() == NEW
    assert set(tmp_path.iterdir()) == {folder, made}


@pytest.mark.parametrize("code", [errno.EXDEV, errno.EACCES, errno.EBUSY, errno.ENOSPC])
@pytest.mark.parametrize("there", [False, True])
def test_what_cannot_be_moved_into_place_is_kept_and_named(tmp_path, monkeypatch, code, there):
    folder = tmp_path / "unit"
    if there:
        folder.mkdir()
    with pytest.raises(WedgeError, match=f"unit cannot be written: {os.strerror(code)}") as told:
        with new_folder(folder) as temporary:
            (temporary / "part").write_bytes(NEW)
            monkeypatch.setattr(Path, "replace", failing(code))
    made = the_whole_one_told_of(told)
    assert (made / "part").read_bytes() == NEW
    assert set(tmp_path.iterdir()) == {made, *([folder] if there else [])}


def test_what_went_with_the_folder_around_it_is_not_said_to_lie_there(tmp_path):
    with pytest.raises(WedgeError, match=r"unit cannot be written: No such file or directory\.$"):
        with new_folder(tmp_path / "deep" / "unit"):
            shutil.rmtree(tmp_path / "deep")


def test_of_two_alike_the_first_stays_and_nothing_else(tmp_path):
    folder = tmp_path / "set"
    with new_folder(folder, alike="card") as later:
        with new_folder(folder, alike="card") as sooner:
            (sooner / "card").write_bytes(OLD)
        (later / "card").write_bytes(NEW)
    assert (folder / "card").read_bytes() == OLD
    with new_folder(folder, alike="card") as latest:  # it came before this one was begun
        (latest / "card").write_bytes(NEW)
    assert (folder / "card").read_bytes() == OLD
    assert list(tmp_path.iterdir()) == [folder]


def test_an_earlier_folder_stays_where_no_new_one_can_be_moved(tmp_path, monkeypatch):
    folder = tmp_path / "unit"
    folder.mkdir()
    (folder / "card").write_bytes(OLD)
    move, moves = Path.replace, []

    def full_after_one_move(self, target):
        moves.append(self)
        if len(moves) == 3:  # refused for its files, moved away, and now the disk is full
            raise OSError(errno.ENOSPC, "No space left on device")
        return move(self, target)

    with (
        pytest.raises(WedgeError, match="No space left") as told,
        new_folder(folder, over="card") as new,
    ):
        (new / "card").write_bytes(NEW)
        monkeypatch.setattr(Path, "replace", full_after_one_move)
    assert (folder / "card").read_bytes() == OLD
    made = the_whole_one_told_of(told)
    assert (made / "card").read_bytes() == NEW
    assert set(tmp_path.iterdir()) == {folder, made}


def test_nothing_but_a_draft_of_the_folder_is_taken_for_left_over(tmp_path):
    whole, draft, other = (f".{name}" for name in ("u[1].0a1b2c3d4e5f", "u[1].draft", "u.draft"))
    left = f"{whole}.draft"
    for name in (whole, draft, other, left):
        (tmp_path / name).mkdir()
    with new_folder(tmp_path / "u[1]"):
        pass
    assert {entry.name for entry in tmp_path.iterdir()} == {"u[1]", whole, draft, other}


def test_many_runs_at_once_leave_one_whole_folder(tmp_path):
    folder = tmp_path / "unit"

    def run(number):
        with new_folder(folder, over="card") as temporary:
            for name in ("card", "part"):
                (temporary / name).write_text(str(number))

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(run, range(64)))
    assert list(tmp_path.iterdir()) == [folder]
    assert (folder / "card").read_text() == (folder / "part").read_text()


named_contents = st.dictionaries(
    st.text("abc./", min_size=1, max_size=4).filter(lambda n: set(n) - set("./")),
    st.binary(max_size=20),
    min_size=1,
    max_size=4,
)


@given(named_contents, named_contents)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_hash_is_of_names_and_contents_and_not_of_the_place(tmp_path, one, two):
    def hashed(contents, salt):
        paths = {}
        for name, content in contents.items():
            path = tmp_path / hashlib.sha256(f"{salt}{name}".encode()).hexdigest()
            path.write_bytes(content)
            paths[name] = path
        return sha256_of_files(paths)

    assert hashed(one, "here") == hashed(dict(reversed(one.items())), "there")
    assert (hashed(one, "a") == hashed(two, "b")) == (one == two)
