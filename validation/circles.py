# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How well circles are found without a hint: against drawn ones, and against rendered truth.

``python -m validation.circles`` prints one row a set that is on this machine; it takes about a
minute and a half.
"""

import argparse
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.stats import rankdata

from recon.images import read_frame
from recon.labels.find_circle import candidates, color_change, find_circle, search_image
from recon.pixels import cap_height_mm
from recon.presses import PressReader, press_reader
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import BallLabel, read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from validation.datasets import dataset_folder, on_this_machine, shared_folder
from validation.importers.known_depth import published_labels
from validation.intervals import Interval, bootstrap_intervals, counted, remark

COMPARED_AT_PX = 320
"""Width at which distances are stated."""
RIGHT_WITHIN_PX = 3.5
RIGHT_RADIUS = (0.7, 1.25)
"""Of the radius in the set: a fit with such a radius and near enough is right."""
SETS = ("taxim-gelsight", "known-depth", "twin-standard", "twin-finger")


@dataclass(frozen=True)
class Found:
    """What was found of one labelled press, distances at 320 px of width."""

    offset_px: tuple[float, float] | None
    """Found minus labelled centre; ``None`` where the press was missed."""
    fits: tuple[tuple[float, bool], ...]
    """Quality of each proposed disc after its fit, and whether it is the labelled one."""
    spread: float | None = None
    """Of the outline (``recon.labels.outline``), in contact radii."""
    radius_ratio: float | None = None
    """Found over labelled radius."""
    cap_ratio: float | None = None
    """Height of the ball's cap over the found circle, over that on the labelled one."""


@dataclass(frozen=True, kw_only=True)
class CircleErrors:
    """One set's row; where every press was missed there are no distances."""

    name: str
    presses: int
    missed: int
    median_px: float | None = None
    mean_px: float | None = None
    within_90_px: float | None = None
    bias_px: tuple[float, float] | None = None
    """Median of the offsets along x and y."""
    radius_ratio: float | None = None
    """Median of found over labelled radii."""
    radius_ratios: tuple[float, float] | None = None
    """Least and most of them."""
    cap_ratio: float | None = None
    """Median of the caps' heights, found over labelled."""
    spread: float | None = None
    """Median of the outlines': ``recon.labels.find_circles`` chooses by it how all are centred."""


def labelled(name: str) -> tuple[PressReader, Sequence[BallLabel]]:
    """A set with the circles that its authors drew, or that it was rendered from.

    Raises:
        WedgeError: the set is not on this machine, cannot be read, or has no circle.
    """
    dataset = read_dataset(dataset_folder(name))
    drawn = published_labels(shared_folder() / name) if name == "known-depth" else dataset.labels
    if not drawn:
        raise WedgeError(f"{name} has no circle in its labels.csv: name a set of labelled balls.")
    return press_reader(dataset), drawn


def look(reader: PressReader, label: BallLabel) -> Found:
    """Find one press as if it had no label."""
    ball_mm, pitch_mm = reader.dataset.ball_radius_mm(label), reader.dataset.card.mm_per_px
    difference = reader.unwarp(read_frame(reader.dataset.folder, label.file)) - reader.blank
    scale = COMPARED_AT_PX / difference.shape[1]
    truth = np.array(label.center_px)
    small, ball_px = search_image(difference, ball_mm, pitch_mm)
    shrunk = small.shape[1] / difference.shape[1]
    fits = []
    for one in candidates(small, color_change(small), ball_px):
        away_px = np.hypot(*((np.array(one.center_px) + 0.5) / shrunk - 0.5 - truth)) * scale
        ratio = one.radius_px / shrunk / label.contact_radius_px
        is_right = away_px < RIGHT_WITHIN_PX and RIGHT_RADIUS[0] < ratio < RIGHT_RADIUS[1]
        fits.append((one.quality, bool(is_right)))
    circle = find_circle(difference, ball_mm, pitch_mm)
    if circle is None:
        return Found(None, tuple(fits))
    x_px, y_px = scale * (np.array(circle.center_px) - truth)
    side_mm = float(np.sqrt(np.prod(pitch_mm)))
    return Found(
        (float(x_px), float(y_px)),
        tuple(fits),
        spread=circle.spread,
        radius_ratio=circle.radius_px / label.contact_radius_px,
        cap_ratio=cap_height_mm(circle.radius_px * side_mm, ball_mm)
        / cap_height_mm(label.contact_radius_px * side_mm, ball_mm),
    )


def summary(name: str, found: Sequence[Found]) -> CircleErrors:
    """One row from what was found of every press."""
    offsets = [one.offset_px for one in found if one.offset_px is not None]
    row = CircleErrors(name=name, presses=len(found), missed=len(found) - len(offsets))
    if not offsets:
        return row
    away = np.hypot(*np.transpose(offsets))
    radii = [one.radius_ratio for one in found if one.radius_ratio is not None]
    bias = np.median(offsets, axis=0)
    return replace(
        row,
        spread=_median([one.spread for one in found]),
        radius_ratio=_median(radii),
        radius_ratios=(min(radii), max(radii)) if radii else None,
        cap_ratio=_median([one.cap_ratio for one in found]),
        median_px=float(np.median(away)),
        mean_px=float(away.mean()),
        within_90_px=float(np.quantile(away, 0.9)),
        bias_px=(float(bias[0]), float(bias[1])),
    )


def _median(values: Sequence[float | None]) -> float | None:
    """Of those that there are."""
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def area_under_curve(fits: Sequence[tuple[float, bool]]) -> float | None:
    """Probability that a right fit has a higher quality than a wrong one (Mann and Whitney).

    ``None`` where there are not both.
    """
    if len({is_right for _, is_right in fits}) < 2:
        return None
    quality, right = (np.array(column) for column in zip(*fits, strict=True))
    ranks, count = rankdata(quality), right.sum()
    excess = ranks[right].sum() - count * (count + 1) / 2
    return float(excess / (count * (len(fits) - count)))


def interval(found: Sequence[Found]) -> Interval | None:
    """95 % interval of that area over presses drawn again, each with all of its fits.

    ``None`` for too few of them, and where no draw would have another area: where all fits are
    right, or wrong, or every right one is better than every wrong one, or worse.
    """
    fits = [fit for one in found for fit in one.fits]
    if area_under_curve(fits) in (None, 0.0, 1.0):
        return None
    press = np.repeat(np.arange(len(found)), [len(one.fits) for one in found])
    quality, right = (np.array(column) for column in zip(*fits, strict=True))
    of = (press[:, None] == np.arange(len(found))).astype(float)
    above = np.sign(quality[~right] - quality[right][:, None])
    misjudged = of[right].T @ ((above + 1) / 2) @ of[~right]  # by press of the right, of the wrong

    def beyond(drawn: Float64[np.ndarray, "r p"]) -> Float64[np.ndarray, "r 1"]:
        """What the area lacks of one: the share of pairs in the wrong order."""
        pairs = (drawn @ of[right].sum(0)) * (drawn @ of[~right].sum(0))
        share = np.full_like(pairs, np.nan)
        np.divide(((drawn @ misjudged) * drawn).sum(1), pairs, out=share, where=pairs > 0)
        return share[:, None]

    intervals = bootstrap_intervals(beyond, len(found), seed=0)
    if intervals is None:
        return None
    ((low, high),) = intervals
    return max(1 - high, 0.0), 1 - low


def measure(names: Sequence[str], pool: Executor) -> Mapping[str, object]:
    """Rows of some sets, and how well the quality tells right from wrong.

    Raises:
        WedgeError: a set is not on this machine or cannot be read.
    """
    rows, looked = [], []
    for name, (reader, labels) in [(name, labelled(name)) for name in names]:
        found = list(pool.map(partial(look, reader), labels, chunksize=2))
        rows.append(summary(name, found))
        looked += found
        print(_line(rows[-1]), flush=True)
    fits = [fit for one in looked for fit in one.fits]
    auc, ci95 = area_under_curve(fits), interval(looked)
    right = sum(is_right for _, is_right in fits)
    counts = f"{right} right fits from {len(fits) - right} wrong ones"
    if auc is None:
        print(f"nothing shows how well the quality tells {counts}")
    else:
        ends = f"{ci95[0]:.3f}-{ci95[1]:.3f}, 95 % over " if ci95 else ""
        over = remark(f"{ends}{counted(len(looked))}", len(looked))
        print(f"quality tells {counts}: AUC {auc:.3f} ({over})")
    return {
        "sets": [asdict(row) for row in rows],
        "fits": len(fits),
        "right": right,
        "auc": auc,
        "auc_ci95": ci95 and list(ci95),
    }


def _line(row: CircleErrors) -> str:
    if row.bias_px is None:
        return f"{row.name}: {row.presses} presses, all missed"
    x_px, y_px = row.bias_px
    radius = ""
    if row.radius_ratios is not None:
        least, most = row.radius_ratios
        radius = (
            f"; radii {row.radius_ratio:.3f} of the set's (median; {least:.3f} to {most:.3f}), "
            f"caps {row.cap_ratio:.2f} as high (median)"
        )
    spread = "" if row.spread is None else f"; outlines spread by {row.spread:.3f} radii"
    return (
        f"{row.name}: {row.presses} presses, {row.missed} missed; at {COMPARED_AT_PX} px of width "
        f"centres are off by {row.median_px:.2f} px (median), {row.mean_px:.2f} (mean), "
        f"{row.within_90_px:.2f} (90 %), bias ({x_px:+.2f}, {y_px:+.2f}){radius}{spread}"
    )


def main() -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(prog="python -m validation.circles", description=__doc__)
    parser.add_argument("sets", nargs="*", help="by default every one with circles that is here")
    parser.add_argument("--json", type=Path, help="write the numbers here")
    arguments = parser.parse_args()
    with ending_in_a_sentence(parser):
        check_outputs(arguments.json)
        with ProcessPoolExecutor(2) as pool:
            numbers = measure(arguments.sets or on_this_machine(SETS), pool)
        write_json(arguments.json, numbers)


if __name__ == "__main__":
    main()
