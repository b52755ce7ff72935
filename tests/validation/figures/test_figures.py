# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every figure: no label is cut off, and the same arrays give the same bytes."""

from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from recon.ball import ball_cap
from recon.geometry.lens import Boards, Lens
from tests.chessboards import PATTERN, TILTS, TRUE, board_points, straight_lens
from validation.depth import DepthErrors
from validation.error_table import WEDGE_CONFIGURATIONS, Row
from validation.examples import PressPicture
from validation.figures.ball_press import press_figure, strip_figure
from validation.figures.depth_map import depth_figure, doubt_figure
from validation.figures.depth_scatter import peak_figure, rmse_figure
from validation.figures.error_bars import PAPER, error_figure
from validation.figures.gradients import gradient_figure
from validation.figures.integrators import cap_error_figure, convergence_figure
from validation.figures.lens import lens_figure
from validation.figures.light_lobes import lobe_azimuth_deg, lobe_figure, sector_means
from validation.figures.maps import round_length_mm
from validation.figures.png import png_bytes
from validation.figures.tracking import roll_figure
from validation.metrics import METRICS, PIXEL_SETS, Errors
from validation.table_text import row_cells

GRADIENT = np.random.default_rng(0).uniform(-1, 1, (4000, 2))
LIGHTS_DEG = {"R": 90.0, "G": 180.0, "B": -90.0}


def depth_map(width: int, height: int) -> np.ndarray:
    at = (0.4 * width, 0.6 * height)
    return ball_cap((width, height), at, 0.9, 2.0, (0.1, 0.1)).depth_mm


def press(width: int = 48, height: int = 36, at: tuple[float, float] = (20.0, 17.0)):
    cap = ball_cap((width, height), at, 1.2, 2.0, (0.1, 0.1))
    difference = np.random.default_rng(0).normal(0, 0.05, (height, width, 3)).astype(np.float32)
    return PressPicture(
        title="press00.png of a set with a long name, held out",
        frame=np.clip(0.5 + difference, 0, 1).astype(np.float32),
        difference=difference,
        gradient=cap.gradient * 0.9,
        gradient_truth=cap.gradient,
        depth_mm=cap.depth_mm * 0.95 + 0.05,
        depth_truth_mm=np.where(cap.contact, cap.depth_mm, np.nan),
        truth="ideal ball",
        center_px=at,
        contact_radius_mm=1.2,
        mm_per_px=(0.1, 0.1),
    )


def rows() -> list[Row]:
    return [
        Row(
            configuration=configuration,
            missing_axis=missing,
            estimator=estimator,
            pixels=pixels,
            errors=Errors(
                values=dict.fromkeys(METRICS, value),
                ci95=dict.fromkeys(METRICS, (0.9 * value, 1.2 * value)),
                mean_abs_gradient=0.5,
                curvature=1.0,
                n_pixels=1000,
                n_presses=8,
            ),
        )
        for estimator, value in (("mlp", 4.0), ("table", 27.0))
        for configuration, fillings in WEDGE_CONFIGURATIONS.items()
        for missing in fillings
        for pixels in PIXEL_SETS
    ]


def depth_errors() -> dict[str, list[DepthErrors]]:
    def one(true_mm: float, error_mm: float) -> DepthErrors:
        return DepthErrors(
            file="a.png",
            truth="ball cap",
            rmse_mm=abs(error_mm),
            bias_mm=error_mm,
            peak_mm=true_mm + error_mm,
            peak_truth_mm=true_mm,
        )

    return {
        "mlp": [one(1.0, 0.05), one(1.4, -0.1)],
        "table": [one(1.0, 0.2), one(1.4, -0.4)],
    }


FIGURES = {
    "depth map, landscape": lambda: depth_figure(depth_map(64, 48), (0.1, 0.1), title="name " * 40),
    "depth map, portrait": lambda: depth_figure(depth_map(48, 64), (0.1, 0.1), title="press"),
    "doubt": lambda: doubt_figure(
        (0.2 * depth_map(64, 48)).astype(np.float32), (0.1, 0.1), title="press: doubt"
    ),
    "depth map, strip": lambda: depth_figure(depth_map(240, 30), (0.1, 0.1)),
    "depth map, untouched": lambda: depth_figure(np.zeros((12, 16)), (0.02, 0.03)),
    "depth map, all deep": lambda: depth_figure(np.full((12, 16), 100.0), (1.0, 1.0)),
    "press": lambda: press_figure(press()),
    "press, portrait": lambda: press_figure(press(36, 48)),
    "press at the corner": lambda: press_figure(press(at=(1.0, 35.0))),
    "strip": lambda: strip_figure(press()),
    "errors, contact": lambda: error_figure(rows(), "contact"),
    "errors, contact+5%": lambda: error_figure(rows(), "contact+5%"),
    "errors, one estimator": lambda: error_figure(rows()[:12], "contact"),
    "peaks": lambda: peak_figure(depth_errors()),
    "depth RMSE": lambda: rmse_figure(depth_errors()),
    "gradient error": lambda: gradient_figure(0.9 * GRADIENT, GRADIENT),
    "light lobes": lambda: lobe_figure(colors(), GRADIENT, LIGHTS_DEG),
    "light lobes, few pixels": lambda: lobe_figure(colors()[:20], GRADIENT[:20]),
    "ball caps": lambda: cap_error_figure(
        depth_map(64, 48), {"dirichlet": 1.01 * depth_map(64, 48)}, (0.1, 0.1)
    ),
    "roll": lambda: roll_figure([0.0, 90.0], {"joint": [0.2, 0.7], "gicp": [1, 9]}, "roll"),
    "lens": lambda: lens_figure(boards(TRUE), TRUE),
    "convergence": lambda: convergence_figure((15, 30, 60), {"dirichlet": (0.16, 0.04, 0.01)}),
}


def boards(lens: Lens) -> Boards:
    """Corners as a lens shows them, 0.2 px off."""
    rng = np.random.default_rng(0)
    seen = [lens.distort(board_points(tilt, i)) for i, tilt in enumerate(TILTS)]
    return Boards(
        frame_size_px=lens.frame_size_px,
        pattern=PATTERN,
        corners_px={str(i): at + rng.normal(0, 0.2, at.shape) for i, at in enumerate(seen)},
        left_out=(),
    )


def colors() -> np.ndarray:
    """Lambert's law, to first order: a colour grows as depth falls toward its light."""
    azimuths = np.radians([LIGHTS_DEG[channel] for channel in "RGB"])
    return -0.1 * GRADIENT @ np.stack([np.cos(azimuths), np.sin(azimuths)])


@pytest.mark.parametrize("name", FIGURES)
def test_no_label_is_cut_off(name: str) -> None:
    figure = FIGURES[name]()
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    width, height = figure.bbox.size
    beyond = undrawn_tick_labels(figure)
    seen = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    boxes = {text.get_text(): text.get_window_extent() for text in seen if text not in beyond}
    assert boxes
    outside = {
        text: box.extents
        for text, box in boxes.items()
        if box.x0 < 0 or box.y0 < 0 or box.x1 > width or box.y1 > height
    }
    assert not outside


@pytest.mark.parametrize("name", FIGURES)
def test_no_words_are_an_unread_formula(name: str) -> None:
    figure = FIGURES[name]()
    png_bytes(figure, dpi=50)
    assert not [x for x in figure.findobj(Text) if "$" in x.get_text()]


def undrawn_tick_labels(figure: Figure) -> list[Text]:
    """Ticks beyond the ends of their axis exist, but are not drawn."""
    labels = []
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            margin = 1e-6 * (high - low)
            for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
                if not low - margin <= tick.get_loc() <= high + margin:
                    labels += [tick.label1, tick.label2]
    return labels


@pytest.mark.parametrize("name", FIGURES)
def test_same_arrays_give_same_bytes(name: str) -> None:
    content = png_bytes(FIGURES[name](), dpi=50)
    assert content == png_bytes(FIGURES[name](), dpi=50)
    assert content.startswith(b"\x89PNG")
    assert b"matplotlib" not in content.lower()


def test_the_readers_settings_neither_matter_nor_change() -> None:
    plain = png_bytes(FIGURES["peaks"](), dpi=50)
    with matplotlib.rc_context({"font.size": 30, "lines.linewidth": 9}):
        assert png_bytes(FIGURES["peaks"](), dpi=50) == plain
        assert matplotlib.rcParams["font.size"] == 30


@pytest.mark.parametrize(
    "longest, length", [(0.4, 0.2), (0.5, 0.5), (1.0, 1.0), (6.8, 5.0), (99.0, 50.0)]
)
def test_scale_bars_are_round(longest: float, length: float) -> None:
    assert round_length_mm(longest) == pytest.approx(length)


def test_scale_bar_is_as_long_as_it_says() -> None:
    axes = depth_figure(depth_map(64, 48), (0.1, 0.1)).axes[0]
    (bar,) = axes.patches
    (label,) = [text.get_text() for text in axes.texts]
    width_mm = axes.get_xlim()[1]
    assert width_mm == pytest.approx(6.4)
    assert bar.get_width() * width_mm == pytest.approx(float(label.removesuffix(" mm")))


def test_maps_keep_pixels_square_in_mm() -> None:
    figure = depth_figure(np.ones((30, 40)), (0.1, 0.2))
    width, height = figure.axes[0].get_window_extent().size
    assert width / height == pytest.approx(40 * 0.1 / (30 * 0.2), rel=1e-3)


def test_a_lens_that_bends_nothing_leaves_straight_lines_where_they_are() -> None:
    lens = straight_lens(TRUE.frame_size_px)
    axes = lens_figure(boards(lens), lens).axes[1]
    *grid, circle, _center = [line.get_xydata() for line in axes.get_lines()]
    assert len(grid) == 36
    for straight, shown in zip(grid[::2], grid[1::2], strict=True):
        np.testing.assert_allclose(shown, straight, atol=1e-9)
    seen = np.concatenate(list(boards(lens).corners_px.values()))
    farthest_px = np.linalg.norm(seen - lens.center_px, axis=1).max()
    np.testing.assert_allclose(np.linalg.norm(circle - lens.center_px, axis=1), farthest_px)


@pytest.mark.parametrize("channel", "RGB")
def test_lobes_point_at_their_lights(channel: str) -> None:
    centers_deg, means = sector_means(colors(), GRADIENT)
    found = lobe_azimuth_deg(centers_deg, means[:, "RGB".index(channel)])
    assert abs((found - LIGHTS_DEG[channel] + 180) % 360 - 180) < 3


def test_a_colour_without_a_light_has_no_lobe() -> None:
    figure = lobe_figure(colors(), GRADIENT, {"R": 90.0, "B": -90.0})
    words = " ".join(text.get_text() for text in figure.legends[0].get_texts())
    assert "R: +" in words and "B: −" in words and "G" not in words


def test_the_share_of_presses_stays_whole_beyond_the_worst() -> None:
    axes = rmse_figure(depth_errors()).axes[0]
    for line, errors in zip(axes.lines, depth_errors().values(), strict=False):
        x_mm, share = line.get_xydata().T
        assert (x_mm[0], share[0]) == (0, 0)
        assert (x_mm[-1], share[-1]) == (axes.get_xlim()[1], 100)
        worst_mm = max(error.rmse_mm for error in errors)
        assert share[x_mm >= worst_mm].tolist()[-2:] == [100, 100]


def test_the_papers_values_stand_only_beside_its_own_pixels() -> None:
    def words(figure: Figure) -> set[str]:
        return {text.get_text() for text in figure.findobj(Text)}

    assert PAPER in words(error_figure(rows(), "contact+5%"))
    assert PAPER not in words(error_figure(rows(), "contact"))


def test_the_papers_marks_are_whole_beside_a_far_better_sensor() -> None:
    figure = error_figure([better(row) for row in rows()[:12]], "contact+5%")
    FigureCanvasAgg(figure).draw()
    for axes in figure.axes:
        (marks,) = (line for line in axes.lines if line.get_label() == PAPER)
        places = axes.transData.transform(marks.get_xydata())
        half_px = (marks.get_markersize() / 2 + marks.get_markeredgewidth()) * figure.dpi / 72
        assert len(places) == 6
        assert (places[:, 0] - half_px >= axes.bbox.x0).all()
        assert (places[:, 0] + half_px <= axes.bbox.x1).all()


@pytest.mark.parametrize("few", [0, 6, 12])
def test_a_mean_over_one_press_has_no_whisker(few: int) -> None:
    chosen = rows()[:12]  # of two pixel sets
    one = [replace(row, errors=replace(row.errors, n_presses=1, ci95=dict.fromkeys(METRICS)))
           for row in chosen]  # fmt: skip
    figure = error_figure([*one[:few], *chosen[few:]], "contact")
    for axes in figure.axes:
        (bars,) = axes.containers
        assert bars.has_xerr == (few < 12)
        spans = [path for lines in bars.lines[2] for path in lines.get_segments()]
        lengths = [np.ptp(span[:, 0]) for span in spans if len(span) and np.isfinite(span).all()]
        assert lengths == pytest.approx([0.3 * 4.0] * (6 - few // 2))
        assert axes.get_xlim()[1] > 4.0


def better(row: Row) -> Row:
    """The same with a tenth of the errors."""
    values = {name: value / 10 for name, value in row.errors.values.items()}
    ci95 = {name: (0.9 * value, 1.2 * value) for name, value in values.items()}
    return replace(row, errors=replace(row.errors, values=values, ci95=ci95))


def test_the_figure_and_the_table_call_a_configuration_alike() -> None:
    figure = error_figure(rows(), "contact")
    lines = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert lines == list(dict.fromkeys(row_cells(row)[0] for row in rows()))


@pytest.mark.parametrize("name", ["n$x_{$", "presses 5$ ball_2 and 7$ ball"])
def test_a_name_with_dollars_is_no_formula(name: str) -> None:
    figure = press_figure(replace(press(), title=name))
    png_bytes(figure)
    assert name in [text.get_text() for text in figure.findobj(Text)]
    assert not any(text.get_parse_math() for text in figure.findobj(Text))
