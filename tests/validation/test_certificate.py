# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Grades, and the forms in which a certificate says them."""

import html
import json
import shutil
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from app.__main__ import main
from recon.images import read_image
from recon.presses import LeftOut
from recon.stream import Recorder, TimedFrame
from sensor.dataset import write_labels
from sensor.documents import json_bytes
from tests.app.commands import run
from tests.validation.sensors import change_frames
from validation.acceptance.errors import error_intervals, error_values
from validation.acceptance.limits import GROUPS, LIMITS, Limit, verdict
from validation.evaluation import held_out_metrics
from validation.report.certificate import (
    Occasion,
    document,
    junit_xml,
    lead,
    lines,
    number,
    origin,
    page_html,
)
from validation.report.certificate_sheet import FLATTER_THAN, pdf_bytes, picture, sheet

SET = Occasion(dataset="<set>", dataset_sha256="5e7" * 20, judged="2026-02-03", software="4.5.6")


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.name)
def test_grades_follow_their_limits_and_every_limit_has_a_reason(limit: Limit):
    worse = 1 if limit.less_is_better else -1
    assert [limit.grade(limit.grade_a), limit.grade(limit.grade_b)] == ["A", "B"]
    assert limit.grade(limit.grade_b + worse * 1e-6) == "fail"
    assert limit.grade(float("nan")) == "fail"
    assert limit.worst({"R": limit.grade_a, "G": limit.grade_b})[0] == "G"
    assert limit.worst({"R": float("nan"), "G": limit.grade_b})[0] == "R"
    assert 20 < len(limit.reason) < 95 and limit.group in GROUPS
    for bound in (limit.grade_a, limit.grade_b):
        assert float(number(limit, bound)) == pytest.approx(limit.shown_times * bound)
    assert number(limit, 3.14159 / limit.shown_times) == "3.14"


def test_the_worst_grade_decides(accepted):
    values = dict(accepted.values)
    assert verdict(values | {"moved_px": {"": 2.0}}) == "B"
    assert verdict(values | {"moved_px": {"": float("inf")}}) == "fail"
    assert verdict(values | {"contrast_gray_levels": {"R": 30.0, "G": 1.0, "B": 30.0}}) == "fail"


def test_no_two_grades_share_one_bound(accepted):
    shown = {line.title: line for line in lines(accepted)}
    assert all(line.limit_a != line.limit_b for line in shown.values())
    counted = shown["colours in each other's place"]
    assert (counted.limit_a, counted.limit_b) == ("≤ 0", "–")


def test_every_form_of_the_certificate_says_the_same(calibration, accepted):
    spoilt = {"moved_px": {"": float("inf")}, "contrast_gray_levels": {"R": 30.0, "G": 1.0}}
    failed = replace(accepted, values={**accepted.values, **spoilt})
    card = calibration.card
    said = json.loads(json_bytes(document(card, SET, failed)))
    assert said["grade"] == "fail"
    suite = ElementTree.fromstring(junit_xml(card, "<set>", failed))
    broken = [case.get("name") for case in suite if case.find("failure") is not None]
    assert (
        broken
        == ["contrast_gray_levels", "moved_px"]
        == [entry["name"] for entry in said["measurements"] if entry["grade"] == "fail"]
    )
    assert int(suite.get("tests")) == len(suite) and int(suite.get("failures")) == len(broken)
    assert int(suite.get("skipped")) == len([*suite.iter("skipped")]) == len(said["not_measured"])
    for entry in said["measurements"]:  # what JSON says suffices to grade a value anew
        limit = next(limit for limit in LIMITS if limit.name == entry["name"])
        ends = {"grade_a": entry["limit_a"], "grade_b": entry["limit_b"]}
        value = float("nan") if entry["value"] is None else entry["value"]
        assert replace(limit, **ends).grade(value) == entry["grade"]
        assert entry["less_is_better"] is (entry["limit_a"] < entry["limit_b"])
        assert "%" not in entry["unit"] and (limit.shown_times > 1 or entry["unit"] == limit.unit)
    page = page_html(card, SET, failed, "")
    assert "picture moved since calibration: unknown px" in page and "<set>" not in page
    assert "contrast inside a contact (G): 1.00 grey levels" in page
    assert all(html.escape(limit.title) in page for limit in LIMITS if limit.name in failed.values)
    pdf = pdf_bytes(card, SET, failed)
    assert pdf.startswith(b"%PDF") and pdf == pdf_bytes(card, SET, failed)


def test_a_unit_keeps_the_intervals_of_its_errors(calibration, accepted):
    errors = accepted.errors
    card = replace(calibration.card, metrics=held_out_metrics(errors, fitted_presses=12))
    kept = error_intervals(None, card)
    assert kept == error_intervals(errors, card) == accepted.intervals
    assert set(kept) == {"theta_x_deg", "theta_y_deg", "depth_rmse_share"}
    for name, (low, high) in kept.items():
        assert 0 < low < error_values(None, card)[name][""] < high


def test_every_form_says_what_is_doubtful_and_what_was_left_out(calibration, accepted):
    card = calibration.card
    left_out = tuple(
        LeftOut(file=f"press{i}.png", reason="it is the same picture as press1.png")
        for i in range(2, 7)
    )
    found = replace(
        accepted,
        doubts=("2 presses: too few to trust.",),
        left_out=left_out,
    )
    said = document(card, SET, found)
    assert said["left_out"][4] == {"file": "press6.png", "reason": left_out[4].reason}
    assert said["doubts"] == list(found.doubts)
    assert said["mean_abs_gradient"] == accepted.mean_abs_gradient > 0.1
    steep = f"{accepted.mean_abs_gradient:.2f} on average (mean |G|)"
    shown = " ".join(text.get_text() for text in sheet(card, SET, found).texts)
    for form in (page_html(card, SET, found, ""), shown):
        assert found.doubts[0] in form and steep in form
        assert "Left out 5 presses: press2.png: it is the same" in form and "and 2 more." in form


def test_a_set_of_which_some_was_learnt_says_so(calibration, accepted):
    some = replace(accepted, learnt=1, presses=13)
    assert "13 presses, 1 of which it was calibrated on: errors are those of the 12 others" in lead(
        calibration.card, SET, some
    )


def test_a_design_that_nobody_named_has_no_hash_on_the_certificate(calibration, accepted):
    unnamed = replace(calibration.card, design_sha256=None)
    assert "no design was named" in origin(unnamed, SET)
    assert document(unnamed, SET, accepted)["design_sha256"] is None
    assert "the design's with abababababab" in origin(
        replace(unnamed, design_sha256="ab" * 32), SET
    )


def test_every_form_says_on_how_many_presses_errors_rest_and_when(calibration, accepted):
    card = calibration.card
    few = replace(accepted, learnt=12, held_out=2, intervals={}, errors=None)
    for found, said, there in (
        (few, "measured on 2 presses held out, too few for an interval.", False),
        (accepted, "12 presses that it was not calibrated on, with 95 % intervals", True),
    ):
        shown = [text.get_text() for text in sheet(card, SET, found).texts]
        page = page_html(card, SET, found, "")
        for form in (page, " ".join(shown)):
            assert said in form and "2026-02-03" in form and "4.5.6" in form
            assert SET.dataset_sha256[:12] in form and "no design was named" in form
        assert any("[" in text for text in shown) is there is ("% interval " in page)
        kept = document(card, SET, found)
        assert kept["held_out_presses"] == found.held_out and kept["judged"] == "2026-02-03"
        assert kept["learnt_presses"] == found.learnt and "held_out" not in kept
        assert kept["errors_from"] == ("dataset" if found.errors else "calibration")
        ends = {entry["name"]: entry["ci95"] for entry in kept["measurements"] if entry["ci95"]}
        assert ends == {name: list(pair) for name, pair in found.intervals.items()}
    unsaid = replace(few, held_out=8)
    assert "8 presses held out, without intervals" in lead(card, SET, unsaid)


@pytest.mark.parametrize(
    ("failed", "said"),
    [(3, None), (4, "1 more failure is in the table."), (5, "2 more failures are in the table.")],
)
def test_the_sheet_counts_the_failures_that_it_leaves_out(calibration, accepted, failed, said):
    spoilt = {name: {"": float("nan")} for name in list(accepted.values)[:failed]}
    figure = sheet(calibration.card, SET, replace(accepted, values=accepted.values | spoilt))
    counted = [text.get_text() for text in figure.texts if "more failure" in text.get_text()]
    assert counted == ([said] if said else [])


@pytest.mark.parametrize("rim_mm", [-1.0, 0.0, 10.0])
@pytest.mark.parametrize("times", [1.0, 3.0])
def test_a_press_and_its_error_fit_their_scales(calibration, accepted, rim_mm, times):
    shown = accepted.press.picture
    read = replace(
        shown,
        depth_mm=times * shown.depth_mm + np.float32(rim_mm),
        depth_truth_mm=shown.depth_truth_mm + np.float32(rim_mm),
    )
    found = replace(accepted, press=replace(accepted.press, picture=read))
    axes = picture(calibration.card, found).axes
    images = {x.get_title("left"): image for x in axes for image in x.images}
    low, high = images["its depth"].get_clim()
    assert low == 0 < high and read.depth_mm.max() <= high
    # A dent that lies deep as a whole is no excuse for its error.
    error_mm = np.nanmax(np.abs(read.depth_mm - read.depth_truth_mm))
    least_mm = FLATTER_THAN * accepted.press.depth.peak_truth_mm
    ends = images["depth error in the contact"].get_clim()
    assert ends[1] == -ends[0] == pytest.approx(max(error_mm, least_mm), rel=1e-4)


@pytest.mark.parametrize("name", ["a\x01b", "a\x00b", "a\ufffeb", "a\x1bb"])
def test_a_name_that_no_xml_may_hold_does_not_spoil_the_test_report(calibration, accepted, name):
    suite = ElementTree.fromstring(junit_xml(calibration.card, name, accepted))
    assert suite.get("name") == f"wedge accept {calibration.card.serial} a\ufffdb"
    plain = "<Kugel & Größe 🙂>"
    suite = ElementTree.fromstring(junit_xml(calibration.card, plain, accepted))
    assert suite.get("name").endswith(f" {plain}")


@pytest.mark.parametrize("serial", ["wedge-001", 5 * "wedge-of-the-left-hand"])
def test_everything_lies_on_the_sheet_and_nothing_on_another(calibration, accepted, serial):
    spoilt = {
        limit.name: dict.fromkeys(accepted.values.get(limit.name, [""]), 98.7 / limit.shown_times)
        for limit in LIMITS
    }
    doubts = tuple("So much may be said of it. " * lines for lines in (3, 7, 7, 7))
    unseen = LeftOut(file="press-0000.png", reason="no contact is visible inside its circle")
    found = replace(accepted, values=spoilt, doubts=doubts, left_out=(unseen,) * 9)
    card = replace(calibration.card, serial=serial)
    figure = sheet(card, SET, found)
    renderer = FigureCanvasAgg(figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in figure.texts]
    width, height = figure.canvas.get_width_height()
    assert all(b.x0 > 0 and b.x1 < width and b.y0 > 0 and b.y1 < height for b in boxes)
    for index, box in enumerate(boxes):
        assert not any(box.overlaps(other.padded(-1)) for other in boxes[:index])
    texts = [text for text in figure.findobj(Text) if text.get_text()]
    assert min(text.get_fontsize() for text in texts if serial not in text.get_text()) >= 7.0
    reasons = html.unescape(page_html(card, SET, found, ""))
    assert all(limit.reason in reasons for limit in LIMITS)


def test_a_recording_tells_the_rate_and_what_has_no_times_is_refused(
    calibration, broken, tmp_path, capsys, monkeypatch
):
    calibration.save(tmp_path / "unit")
    frame = read_image(broken.folder / "background.png")
    for name, untimed in (("A.MCAP", ()), ("folder.mcap", ("wedge",))):
        with Recorder(tmp_path / name, {"wedge": None}, untimed) as recorder:
            for index in range(20):
                time_ns = 10**18 + index * 125_000_000
                recorder.add(
                    "wedge",
                    TimedFrame(index=index, time_ns=time_ns, arrived_ns=time_ns, pixels=frame),
                )
    words = ["accept", str(tmp_path / "unit"), str(broken.folder), "--stream"]
    with pytest.raises(SystemExit) as left:
        main([*words, str(tmp_path / "A.MCAP"), "--json", str(tmp_path / "a.json")])
    measured = json.loads((tmp_path / "a.json").read_text())["measurements"]
    (rate,) = [entry for entry in measured if entry["name"] == "frame_rate_hz"]
    assert (left.value.code, rate["grade"], rate["value"]) == (1, "fail", pytest.approx(8.0))
    for untimed in (broken.folder, tmp_path / "folder.mcap"):
        assert run(*words, untimed) == 2
        assert "when its frames were taken" in " ".join(capsys.readouterr().err.split())


def test_the_command_exits_zero_only_on_a_pass(calibration, broken, tmp_path, capsys, monkeypatch):
    calibration.save(tmp_path / "wedge-007")
    shutil.copy(broken.folder / "press11.png", broken.folder / "twice.png")
    again = [*broken.labels, replace(broken.labels[-1], file="twice.png")]
    write_labels(broken.folder / "labels.csv", again)
    words = ["accept", str(tmp_path / "wedge-007"), str(broken.folder)]
    files = ["--out", str(tmp_path / "paper"), "--junit", str(tmp_path / "accept.xml")]
    assert run(*words, *files) == 0
    told = capsys.readouterr().out
    assert "12 presses that it was not calibrated on" in told
    assert "Left out 1 press: twice.png: it is the same picture as press11.png." in told
    skipped = ElementTree.parse(tmp_path / "accept.xml").iter("skipped")
    reasons = {case.get("message") for case in skipped}
    assert reasons and all(f"({reason}).\n" in told for reason in reasons)
    for name in ("paper/index.html", "paper/certificate.pdf", "accept.xml"):
        assert (tmp_path / name).stat().st_size > 500
    write_labels(broken.folder / "labels.csv", broken.labels)
    change_frames(broken, lambda frame, _: frame[..., ::-1])
    assert run(*words) == 1
    assert "swapped wires" in capsys.readouterr().out
