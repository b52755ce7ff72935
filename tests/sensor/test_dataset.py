# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import shutil
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sensor.dataset import (
    BallLabel,
    Dataset,
    DatasetCard,
    read_dataset,
    write_card,
    write_labels,
)
from sensor.errors import WedgeError
from tests.synthetic import KEYSTONE_PX, make_dataset

CARD = """\
name = "a set"
source = "a lab"
licence = "CC-BY-4.0"
mm_per_px = [0.1, 0.1]
ball_radius_mm = 4.0
background = ["background.png"]
"""
LABELS = "file,center_x_px,center_y_px,contact_radius_px\na.png,30,20.5,10\n"


def folder_of(tmp_path, card=CARD, labels=LABELS):
    (tmp_path / "dataset.toml").write_text(card, encoding="utf-8")
    (tmp_path / "labels.csv").write_text(labels, encoding="utf-8")
    return tmp_path


def changed(key, line):
    """The card with one of its lines replaced, or with one line more."""
    kept = [old for old in CARD.splitlines() if not old.startswith(key)]
    return "\n".join([*kept, line]) + "\n"


def test_a_folder_is_read_as_written(tmp_path):
    dataset = read_dataset(folder_of(tmp_path))
    assert dataset.folder == tmp_path
    assert dataset.card == DatasetCard(
        name="a set",
        source="a lab",
        licence="CC-BY-4.0",
        mm_per_px=(0.1, 0.1),
        ball_radius_mm=4.0,
        background=("background.png",),
    )
    label = BallLabel(file="a.png", center_x_px=30.0, center_y_px=20.5, contact_radius_px=10.0)
    assert dataset.labels == (label,)
    assert dataset.card.unwarped_size_px is None
    assert dataset.ball_radius_mm(label) == 4.0
    assert dataset.ball_radius_mm(replace(label, ball_radius_mm=2.0)) == 2.0
    oblong = replace(dataset.card, mm_per_px=(0.1, 1.7))  # 10 px are 4.1 mm
    assert not replace(dataset, card=oblong).is_within_ball(label)


lengths = st.floats(1e-3, 1e3)
lines = st.text(min_size=1, max_size=20).filter(lambda x: x.strip() and x.splitlines() == [x])
# As a table keeps it: without white space at its ends.
file_names = st.builds(
    "{}.png{}".format,
    st.text("ab é,\"';_-#/", min_size=1, max_size=12).map(str.strip).map(lambda s: s.lstrip("/")),
    st.sampled_from(["", "#0", "#17"]),
).filter(lambda name: ".." not in name and not name.startswith(("#", "/")))
labels = st.builds(
    BallLabel,
    file=file_names,
    center_x_px=st.floats(-1e6, 1e6),
    center_y_px=st.floats(-1e6, 1e6),
    contact_radius_px=st.floats(1e-3, 10),
    ball_radius_mm=st.none() | st.floats(11, 1e3),
    quality=st.none() | st.floats(0, 1),
)
cards = st.builds(
    DatasetCard,
    name=lines,
    source=lines,
    licence=lines,
    mm_per_px=st.tuples(st.floats(1e-3, 1), st.floats(1e-3, 1)),
    ball_radius_mm=st.floats(11, 1e3),
    background=st.lists(file_names, min_size=1, max_size=3).map(tuple),
    lights_deg=st.none()
    | st.dictionaries(st.sampled_from("RGB"), st.floats(-360, 360), min_size=1),
)


@given(cards, st.lists(labels, max_size=4, unique_by=lambda label: label.file), st.booleans())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_card_and_labels_come_back_as_written(tmp_path, card, presses, keystone):
    if keystone:
        pad_size_mm = (200 * card.mm_per_px[0], 150 * card.mm_per_px[1])
        card = replace(card, corners_px=KEYSTONE_PX, pad_size_mm=pad_size_mm)
    write_card(tmp_path / "dataset.toml", card)
    write_labels(tmp_path / "labels.csv", presses)
    again = read_dataset(tmp_path)
    assert again == Dataset(folder=tmp_path, card=card, labels=tuple(presses))
    assert again.card.unwarped_size_px == ((200, 150) if keystone else None)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "lights",
    ["lights_deg = { R = 90, B = -90 }  # seen", "[lights_deg]\nR = 90 # seen\nB = -90"],
)
def test_a_card_is_changed_where_it_must_be_and_what_a_person_wrote_stays(tmp_path, lights, end):
    path = tmp_path / "dataset.toml"
    before = f"""\
# The finger of the third build.
ball_radius_mm = 4  # by the caliper
mm_per_px = [ 0.1, 0.10 ]  # a guess
name = 'a set'
background = [  # the gel at rest
  "one.png",
  "two.png", # after the break
]

source = "a lab"
licence = "CC-BY-4.0"
{lights}
# end
""".replace("\n", end)
    path.write_bytes(b"\xef\xbb\xbf" + before.encode())
    card = read_dataset(tmp_path, labelled=False).card
    write_card(path, card)
    assert path.read_bytes() == before.encode()
    mended = replace(card, mm_per_px=(0.125, 0.25), pad_size_mm=(25.0, 37.5))
    mended = replace(mended, corners_px=KEYSTONE_PX)
    write_card(path, mended)
    assert read_dataset(tmp_path, labelled=False).card == mended
    new = f"corners_px = {[list(xy) for xy in KEYSTONE_PX]}{end}pad_size_mm = [25.0, 37.5]{end}"
    last = f"{lights}\n".replace("\n", end)
    place = f"{last}{new}" if lights.startswith("lights") else f"{new}{last}"
    wanted = before.replace("[ 0.1, 0.10 ]", "[0.125, 0.25]").replace(last, place)
    assert path.read_bytes().decode() == wanted


def test_lights_in_a_table_of_their_own_can_change_and_go(tmp_path):
    before, after = f"# by hand\n{CARD}", "# the end\n"
    for lights_deg in ({"R": 1.0}, None):
        text = f"{before}[lights_deg] # seen\nR = 90\n{after}"
        card = read_dataset(folder_of(tmp_path, text), labelled=False).card
        write_card(tmp_path / "dataset.toml", replace(card, lights_deg=lights_deg))
        again = read_dataset(tmp_path)
        assert again.card == replace(card, lights_deg=lights_deg)
        kept = (tmp_path / "dataset.toml").read_text()
        assert kept.startswith(before) and kept.endswith(after)
        assert ("# seen" in kept) == (lights_deg is not None)


@pytest.mark.parametrize("content", [b"", b"not TOML", b"name = '\xff'", b"a = " + b"[" * 20_000])
def test_a_card_that_says_nothing_is_replaced(tmp_path, content):
    (tmp_path / "dataset.toml").write_bytes(content)
    card = make_dataset(tmp_path / "set", presses=1).card
    write_card(tmp_path / "dataset.toml", card)
    assert read_dataset(tmp_path, labelled=False).card == card


def test_spaces_blank_lines_and_a_byte_order_mark_do_not_matter(tmp_path):
    text = "\ufeff file , center_x_px,center_y_px ,contact_radius_px,quality\r\n\r\n"
    text += " a.png , 30 ,20.5, 10 , \r\n,,,,\r\n"
    expected = read_dataset(folder_of(tmp_path)).labels
    assert read_dataset(folder_of(tmp_path, labels=text)).labels == expected


def test_columns_may_come_in_any_order(tmp_path):
    text = "contact_radius_px,quality,file,center_y_px,center_x_px\n10,0,a.png,20.5,30\n"
    (label,) = read_dataset(folder_of(tmp_path)).labels
    assert read_dataset(folder_of(tmp_path, labels=text)).labels == (replace(label, quality=0.0),)


KEYSTONE = "corners_px = [[20, 10], [150, 18], [138, 108], [32, 100]]\n"


@pytest.mark.parametrize(
    ("card", "sentence"),
    [
        *(
            (changed(key, ""), f"the key {key} is missing")
            for key in ("name", "source", "licence", "mm_per_px", "ball_radius_mm", "background")
        ),
        (changed("licence", 'licence = ""'), "licence must be a line of text"),
        (changed("licence", 'license = "MIT"'), r"unknown key license; did you mean licence\?"),
        (changed("x", "ppmm = 0.1"), "unknown key ppmm"),
        (changed("name", "name = 3"), "name must be a line of text, not 3"),
        (changed("mm_per_px", "mm_per_px = 0.1"), r"mm_per_px must be a pair \[x, y\]"),
        (changed("mm_per_px", "mm_per_px = [0.1, 0]"), "mm_per_px must be a positive number"),
        (changed("mm_per_px", "mm_per_px = [0.1, nan]"), "mm_per_px must be a finite number"),
        (changed("ball_radius_mm", "ball_radius_mm = -4"), "ball_radius_mm must be a positive"),
        (changed("ball_radius_mm", "ball_radius_mm = 1e308"), "must lie between 1e-06 and 1e"),
        (changed("mm_per_px", "mm_per_px = [1e-300, 0.1]"), "must lie between 1e-06 and 1e"),
        (changed("ball_radius_mm", "ball_radius_mm = '4'"), "ball_radius_mm must be a finite"),
        (changed("background", "background = []"), "background must be a list of file names"),
        (changed("background", 'background = "b.png"'), "background must be a list"),
        (changed("background", "background = [3]"), "background must be a list"),
        (changed("background", 'background = ["../b.png"]'), "must be a file inside the dataset"),
        (changed("background", 'background = ["/etc/b.png"]'), "must be a file inside"),
        (changed("background", 'background = ["a/../../b.png"]'), "must be a file inside"),
        (changed("background", 'background = [""]'), "must be a file inside"),
        (changed("background", 'background = ["a\\u0000b"]'), "must be a file inside"),
        (CARD + KEYSTONE, "corners_px and pad_size_mm must be given together"),
        (CARD + "pad_size_mm = [12, 9]", "corners_px and pad_size_mm must be given together"),
        (CARD + "corners_px = 3\npad_size_mm = [12, 9]", "corners_px must be four"),
        (CARD + "corners_px = [[0, 0], [1, 0], [1, 1]]\npad_size_mm = [12, 9]", "must be four"),
        (CARD + "corners_px = [[0], [1, 0], [1, 1], [0, 1]]\npad_size_mm = [1, 1]", "must be four"),
        (
            CARD + "corners_px = [[0, 0], [9, 9], [9, 0], [0, 9]]\npad_size_mm = [12, 9]",
            "not the corners of a convex pad",
        ),
        (
            CARD + "corners_px = [[0, 0], [9, 0], [3, 3], [0, 9]]\npad_size_mm = [12, 9]",
            "not the corners of a convex pad",
        ),
        (
            CARD + "corners_px = [[0, 0], [5, 0], [9, 0], [0, 9]]\npad_size_mm = [12, 9]",
            "not the corners of a convex pad",
        ),
        (
            CARD + "corners_px = [[0, 0], [inf, 0], [9, 9], [0, 9]]\npad_size_mm = [12, 9]",
            "corners_px must be a finite number",
        ),
        (CARD + KEYSTONE + "pad_size_mm = [12, 0.01]", "pixels; each side must be 1 to 8192"),
        (CARD + KEYSTONE + "pad_size_mm = [819.3, 9]", "pixels; each side must be 1 to 8192"),
        (CARD + "lights_deg = {}", "lights_deg must be a table such as"),
        (CARD + "lights_deg = {red = 90.0}", "lights_deg must be a table such as"),
        (CARD + "lights_deg = [90.0]", "lights_deg must be a table such as"),
        (CARD + "lights_deg = {R = nan}", "lights_deg must be a finite number"),
        (CARD + "name = 'twice'", "is not valid TOML"),
    ],
)
def test_a_card_that_is_wrong_is_refused_by_file_and_key(tmp_path, card, sentence):
    with pytest.raises(WedgeError, match=rf"dataset\.toml.*{sentence}"):
        read_dataset(folder_of(tmp_path, card=card))


HEADER = "file,center_x_px,center_y_px,contact_radius_px\n"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "has no column file"),
        ("\n\n", "has no column file"),
        ("file,center_x_px,center_y_px\n", "has no column contact_radius_px"),
        (HEADER.replace("\n", ",radius\n"), "unknown key radius"),
        (HEADER.replace("\n", ",file\n"), "has the column file more than once"),
        (HEADER + "a.png,1,2\n", r"line 2: 3 values for 4 columns"),
        (HEADER + "a.png,1,2,3,4\n", r"line 2: 5 values for 4 columns"),
        (HEADER + "a.png,1,2,3\n\nb.png,x,2,3\n", r"line 4: center_x_px = 'x' \(b\.png\) is not a"),
        (HEADER + "a.png,nan,2,3\n", r"line 2: center_x_px = nan \(a\.png\) must be a finite"),
        (HEADER + "a.png,1,-inf,3\n", "center_y_px = -inf .* must be a finite number"),
        (HEADER + "a.png,1,2,nan\n", "contact_radius_px = nan .* must be a positive number"),
        (HEADER + "a.png,1,2,0\n", "contact_radius_px = 0 .* must be a positive number"),
        (HEADER + "a.png,1,2,-3\n", "contact_radius_px = -3 .* must be a positive number"),
        (HEADER + "a.png,1,,3\n", r"center_y_px = '' \(a\.png\) is not a number"),
        (HEADER + ",1,2,3\n", "line 2: file is empty"),
        (HEADER + "../a.png,1,2,3\n", r"'\.\./a\.png' must be a file inside the dataset folder"),
        (HEADER + "/a.png,1,2,3\n", "must be a file inside the dataset folder"),
        (HEADER + "#3,1,2,3\n", "must be a file inside the dataset folder"),
        (
            HEADER.replace("\n", ",ball_radius_mm\n") + "a.png,1,2,3,0\n",
            "ball_radius_mm = 0 .* must be a positive number",
        ),
        (
            HEADER.replace("\n", ",quality\n") + "a.png,1,2,3,good\n",
            r"quality = 'good' \(a\.png\) is not a number",
        ),
        (HEADER + 'a.png,1,2,"3', "line 2|cannot be read as a table"),
        (HEADER.replace(",", ";"), "has semicolons between its columns"),
        (HEADER.replace("\n", ",\n") + "a.png,1,2,3,\n", "has a column without a name"),
        (HEADER + "a.png,1,2,3\nb.png,1,2,3\na.png,9,9,3\n", r"labels a\.png twice"),
        (HEADER + "a.png,1,2,3\n./a.png,9,9,3\n", r"labels \./a\.png twice"),
        (HEADER + "f.npz#1,1,2,3\nf.npz#01,9,9,3\n", r"labels f\.npz#01 twice"),
        (HEADER + "background.png,1,2,3\n", r"labels background\.png, .* the blank gel"),
        (HEADER.replace("\n", ",quality\n") + "a.png,1,2,3,1.5\n", "quality = 1.5 .* from 0 to 1"),
        (HEADER.replace("\n", ",quality\n") + "a.png,1,2,3,nan\n", "quality = nan .* from 0 to 1"),
        (HEADER + "a.png,1,2,1e-300\n", "contact_radius_px = 1e-300 .* from 1e-06 to 1e"),
        (HEADER + "a.png,1,2,40\n", r"of a\.png \(4\.00 mm .* ball 4 mm\)"),
        (HEADER + "a.png,1,2,3\nb.png,1,2,55\n", r"of b\.png \(5\.50 mm"),
        (
            HEADER.replace("\n", ",ball_radius_mm\n") + "a.png,1,2,30,2.5\n",
            r"of a\.png \(3\.00 mm .* ball 2\.5 mm\)",
        ),
    ],
)
def test_labels_that_are_wrong_are_refused_by_file_line_and_press(tmp_path, text, sentence):
    if text.endswith('"3'):
        text += "0" * 200_000  # an open quotation: a field that never ends
    with pytest.raises(WedgeError, match=rf"labels\.csv.*({sentence})"):
        read_dataset(folder_of(tmp_path, labels=text))


def test_what_is_missing_is_named(tmp_path):
    with pytest.raises(WedgeError, match=r"none is not a dataset folder: it has no dataset\.toml"):
        read_dataset(tmp_path / "none")
    folder_of(tmp_path)
    (tmp_path / "labels.csv").unlink()
    with pytest.raises(WedgeError, match=r"labels\.csv is missing"):
        read_dataset(tmp_path)
    (tmp_path / "labels.csv").mkdir()
    with pytest.raises(WedgeError, match=r"labels\.csv cannot be read: Is a directory"):
        read_dataset(tmp_path)


def test_a_table_in_another_encoding_is_refused(tmp_path):
    folder_of(tmp_path)
    (tmp_path / "labels.csv").write_bytes(LABELS.replace("a.png", "é.png").encode("latin-1"))
    with pytest.raises(WedgeError, match=r"labels\.csv cannot be read as a table"):
        read_dataset(tmp_path)


@given(st.binary(max_size=200), st.booleans())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_labels_or_a_sentence(tmp_path, content, with_header):
    folder_of(tmp_path)
    (tmp_path / "labels.csv").write_bytes(HEADER.encode() * with_header + content)
    try:
        read_dataset(tmp_path)
    except WedgeError as error:
        assert "labels.csv" in str(error)


def test_the_hash_does_not_know_the_place(tmp_path):
    dataset = make_dataset(tmp_path / "here", presses=3)
    shutil.copytree(tmp_path / "here", tmp_path / "there")
    (tmp_path / "there" / "notes.txt").write_text("not part of it")
    assert read_dataset(tmp_path / "there").sha256 == dataset.sha256


@pytest.mark.parametrize("in_npz", [False, True], ids=["png", "npz"])
def test_the_hash_changes_with_every_file_that_is_named(tmp_path, in_npz):
    dataset = make_dataset(tmp_path, presses=3, in_npz=in_npz)
    hashes = {dataset.sha256}
    (tmp_path / "camera.toml").write_text("a lens changes every unwarped pixel")
    hashes.add(dataset.sha256)
    files = sorted(tmp_path.iterdir())
    assert len(files) == (5 if in_npz else 7)
    for path in files:
        content = path.read_bytes()
        path.write_bytes(content + b"\n")
        hashes.add(dataset.sha256)
        path.write_bytes(content)
    assert len(hashes) == len(files) + 2
    assert dataset.sha256 in hashes


@given(st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
def test_the_hash_changes_with_any_byte_of_a_frame(tmp_path, data):
    folder_of(tmp_path)
    frame = bytearray(data.draw(st.binary(min_size=1, max_size=50)))
    (tmp_path / "background.png").write_bytes(b"blank")
    (tmp_path / "a.png").write_bytes(frame)
    before = read_dataset(tmp_path).sha256
    place = data.draw(st.integers(0, len(frame) - 1))
    frame[place] ^= data.draw(st.integers(1, 255))
    (tmp_path / "a.png").write_bytes(frame)
    assert read_dataset(tmp_path).sha256 != before


def test_the_hash_of_a_set_with_a_missing_frame_is_a_sentence(tmp_path):
    dataset = read_dataset(folder_of(tmp_path))
    (tmp_path / "background.png").write_bytes(b"blank")
    with pytest.raises(WedgeError, match=r"a\.png cannot be read: No such file"):
        assert dataset.sha256


def test_mirrored_corners_are_a_pad_too(tmp_path):
    mirrored = "corners_px = [[9, 0], [0, 0], [0, 9], [9, 9]]\npad_size_mm = [12, 9]\n"
    assert read_dataset(folder_of(tmp_path, card=CARD + mirrored)).card.corners_px[0] == (9.0, 0.0)


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), min_size=4, max_size=4))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_corners_are_accepted_exactly_where_the_pad_is_convex(tmp_path, points):
    def side(a, b, p):
        return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])

    # Convex: the other two corners lie strictly on one side of every edge, always the same.
    sides = [
        side(points[i], points[(i + 1) % 4], points[j])
        for i in range(4)
        for j in range(4)
        if j not in (i, (i + 1) % 4)
    ]
    convex = min(sides) > 0 or max(sides) < 0
    corners = [list(map(float, point)) for point in points]
    folder_of(tmp_path, card=f"{CARD}corners_px = {corners}\npad_size_mm = [12, 9]\n")
    try:
        read_dataset(tmp_path)
        accepted = True
    except WedgeError:
        accepted = False
    assert accepted == convex
