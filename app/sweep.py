# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge sweep`: a field of the design against the errors that its twin predicts."""

import sys
from concurrent.futures import BrokenExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app._cluster import cluster_pool
from app._output import OutputFile, keep_inputs, print_table
from app._progress import progress
from app._render_refusals import refuse_numbers, refuse_unbuildable
from app._seed import Seed
from app._workers import process_pool
from sensor.design import Wedge
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic, write_json

if TYPE_CHECKING:
    from validation.sweep import SweepPoint


def main(
    field: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FIELD")],
    values: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="VALUE...")],
    design: str = "standard",
    out: Path = Path("build", "sweep"),
    presses: int = 20,
    samples: int = 64,
    width_px: int = 160,
    seed: Seed = 0,
    cluster: str | None = None,
    json: OutputFile = None,
) -> None:
    """Vary one field of a design; predict the gradient error and the lit area for each value.

    For every value, the twin presses a ball many times, and the paper's network is trained on four
    fifths of the presses and judged on the rest.

    FIELD is a part of the design and its field, such as mirror.angle_deg, acrylic.thickness_mm,
    gel.curved, gel.semi_axis_across_mm, lights.red_side_leds, lights.gray_filter_transmission or
    lights.diffuser; lights.lit_sides takes the colours that stay lit (RGB RG RB R). Fields of the
    mirror and the camera are rendered over the mirror, the others straight on. Values that cannot
    be built are named and left out.

    OUT keeps what is rendered: an interrupted sweep continues where it stopped, and no value is
    rendered twice. A kept set is used again only if the whole design, the options, the renderer,
    the libraries and this program's code are those that made it; else a new one is rendered beside
    it. OUT/sweep.png shows the result.

    Example: wedge sweep lights.lit_sides RGB RG RB R --json sweep.json

    Args:
        field: The field to vary.
        values: Its values.
        design: standard, finger, or a TOML file that changes some numbers of one of them.
        out: Folder for the rendered sets and the picture.
        presses: Ball presses per value.
        samples: Light paths per pixel, rounded up as by `wedge simulate`.
        width_px: Pixels along the pad.
        seed: Seed for places, depths, light paths, noise, split and training.
        cluster: Address of a Dask scheduler whose workers render, such as
            tcp://127.0.0.1:8786; by default, processes of this machine do.
        json: Write the numbers here as JSON.
    """
    check_outputs(json, out / "sweep.png")
    keep_inputs([design], [json])
    refuse_numbers(width_px, samples)
    from validation.sweep import LEAST_PRESSES, SweepSize, sweep

    if presses < LEAST_PRESSES:
        raise WedgeError(
            f"--presses {presses} must be at least {LEAST_PRESSES}: some to train on, others to "
            "judge."
        )
    base = load_design(design)
    designs, refusals = _buildable(base, field, values)
    from simulation.engine import best_engine
    from validation.figures.png import png_bytes
    from validation.figures.sweep import sweep_figure
    from validation.intervals import remark

    size = SweepSize(presses=presses, samples=samples, width_px=width_px, seed=seed)
    pool = cluster_pool(cluster) if cluster else process_pool()
    with pool as executor, progress(f"sweep of {field}") as show:
        try:
            points = sweep(
                designs,
                field=field,
                folder=out,
                size=size,
                engine=executor.submit(best_engine).result(),
                executor=executor,
                progress=show,
            )
        except BrokenExecutor as error:
            raise WedgeError(
                "a worker process ended, perhaps for lack of memory: run the same command again; "
                "what is rendered is kept."
            ) from error
    write_atomic(out / "sweep.png", png_bytes(sweep_figure(field, points)))
    print_table(
        [
            field,
            "presses",
            "Gx contact",
            "Gy contact",
            "Gx contact+5%",
            "Gy contact+5%",
            "mean |G|",
            "lit",
        ],
        map(_cells, points),
    )
    judged = (test for _, test in (point.presses for point in points))
    intervals = remark("in brackets 95 % intervals by press", *judged)
    print(
        f"Mean absolute gradient errors, {intervals}. Presses: those trained on and others judged "
        f"on, of {presses} rendered ones whose contact is large enough; seed {seed}. "
        "Lit: share of the pad where every colour has at least half of its own mean. "
        f"Picture: {out / 'sweep.png'}"
    )
    for axis in ("x", "y"):
        if inferred := [point.value for point in points if point.inferred == axis]:
            print(f"G{axis} of {', '.join(inferred)} is inferred: no light shows it.")
    left_out = [{"value": value, "reason": reason} for value, reason in refusals.items()]
    write_json(json, _document(design, field, size, points) | {"left_out": left_out})


def _buildable(
    base: Wedge, field: str, values: tuple[str, ...]
) -> tuple[list[tuple[str, Wedge]], dict[str, str]]:
    """Values with the designs that they give, and why the others give none."""
    from validation.sweep import refuse_field, varied

    refuse_field(base, field)
    designs, refusals = [], dict[str, str]()
    for value in dict.fromkeys(values):
        try:
            changed = varied(base, field, value)
            refuse_unbuildable(changed)
            designs.append((value, changed))
        except WedgeError as error:
            refusals[value] = str(error)
    said = [
        reason if reason.startswith(f"{field} = ") else f"{field} = {value}: {reason}"
        for value, reason in refusals.items()
    ]
    if not designs and len(said) == 1:
        raise WedgeError(said[0])
    for refusal in said:
        print(f"left out {refusal}", file=sys.stderr)
    if not designs:
        raise WedgeError(f"no value of {field} is left to render: give others.")
    return designs, refusals


def _cells(point: "SweepPoint") -> list[str]:
    from validation.table_text import value_cell

    rows, metrics = (point.contact, point.row), ("gx_mae", "gy_mae")
    return [
        point.value,
        " + ".join(map(str, point.presses)),
        *(value_cell(row.errors, metric) for row in rows for metric in metrics),
        f"{point.contact.errors.mean_abs_gradient:.3f}",
        f"{100 * point.lit_area:.0f} %",
    ]


def _document(design: str, field: str, size: Any, points: "list[SweepPoint]") -> dict[str, Any]:
    """The numbers as plain values for JSON; ``None`` for intervals of too few presses."""
    return {
        "design": design,
        "field": field,
        "samples": size.samples,
        "width_px": size.width_px,
        "seed": size.seed,
        "points": [
            {
                "value": point.value,
                "presses": dict(zip(("train", "test"), point.presses, strict=True)),
                "lit_area": point.lit_area,
                "inferred_axis": point.inferred,
                **{
                    name: {
                        "missing_axis": row.missing_axis,
                        **row.errors.values,
                        "ci95": {
                            key: bounds and list(bounds) for key, bounds in row.errors.ci95.items()
                        },
                        "mean_abs_gradient": row.errors.mean_abs_gradient,
                    }
                    for name, row in (("contact", point.contact), ("contact+5%", point.row))
                },
            }
            for point in points
        ],
    }
