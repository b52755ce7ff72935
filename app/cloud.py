# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge cloud`: frames to point clouds and meshes in millimetres."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app._first_contact import first_touched
from app._frames import UnitFrame, is_image, read_checked, unit_frames
from app._gel import laid_on
from app._output import OutputFile, keep_inputs, output_names, print_rows, refuse_unit_folder
from app._progress import progress
from app._remarks import background_remarks, doubt_remarks
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic, write_json

if TYPE_CHECKING:
    from recon.cloud import PointCloud
    from recon.pipeline import Reconstruction, Reconstructor
    from sensor.design import Gel

HEADINGS = (
    *("frame", "points", "touching", "contact", "in shadow", "deepest [mm]"),
    *("median sigma z [mm]", "markers", "file"),
)


def main(
    unit: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="UNIT")],
    where: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="WHERE...")],
    out: Path,
    form: Literal["ply", "pcd", "npz"] = "ply",
    part: Literal["all", "contact"] = "all",
    mesh: bool = False,
    design: str | None = None,
    background: str | None = None,
    frames: int | None = None,
    json: OutputFile = None,
) -> None:
    """Turn frames of a calibrated unit into point clouds of the skin.

    Points are in mm in the gel frame: the origin is the pad's centre, x points right along the
    finger, y down, z out of the gel, so a pressed point lies at z = -depth. Each point has a
    normal, a flag that tells whether something touches there, and sigma, the expected standard
    deviation of z, derived from the estimator's slope errors (NaN for mlp and table, which do not
    estimate them).

    OUT receives one file per frame, named after its image or, in a video or a stream, after its
    number: PLY for MeshLab, Blender or trimesh, PCD for PCL and ROS, NPZ for NumPy. If images are
    named, all are checked before the first file is written.

    The table that is printed gives the number of touched patches, whether the border cuts one, and
    the share of the contact that lies in the shadow of its own dent, where slopes are uncertain.
    Its sigma is the median over all points of the file; `wedge reconstruct` gives the sigma of the
    deepest point. For a video or a stream, the first contact is reported.

    A dataset gives its blank frames, then its labelled presses or, if it has none, all its
    pictures. In a stream, damaged frames are left out and counted; Ctrl-C or SIGTERM ends it, and
    the files written so far are kept.

    Example: wedge cloud units/wedge-001 press.png --out clouds --mesh

    Example: wedge cloud units/wedge-001 touch.mcap --out clouds --part contact --form pcd

    Args:
        unit: A unit folder, written by `wedge calibrate`.
        where: Images, or one video, folder, dataset, recording (.mcap), usb:0 or http address.
        out: The folder for the files; created if missing.
        form: The file format.
        part: All of the skin, or only the contact.
        mesh: Join the points by triangles, for viewing; for PLY or NPZ and the whole skin.
        design: Lay the skin on this design's curved gel (standard, finger or FILE.toml); by default
            on that of the design with which the unit was calibrated, or on flat gel.
        background: A blank frame taken today; by default the unit's own.
        frames: Stop after this many frames.
        json: Write the numbers of points, depths and uncertainties here as JSON.
    """
    from recon.calibration import load_calibration
    from recon.pipeline import Reconstructor

    if mesh and (form == "pcd" or part == "contact"):
        raise WedgeError(
            "--mesh joins the whole skin: use it with --form ply or npz and --part all."
        )
    apart = [name for name in where if is_image(name)]
    names = output_names(apart[:frames], [f".{form}"])
    written = [out / f"{name}.{form}" for name in names or ["cloud"]]
    refuse_unit_folder(out)
    check_outputs(*written, json)
    keep_inputs([unit, *where, background, design], [*written, json])
    if not names and json is not None and _is_cloud(json, out, form):
        raise WedgeError(
            f"{json} could be the file of a cloud in {out}: write the numbers elsewhere."
        )
    calibration = load_calibration(unit)
    built_from, remarks = laid_on(design, unit, calibration)
    blank = None if background is None else read_checked(background, calibration.unwarp)
    remarks += background_remarks(calibration, blank, str(background))
    run = _Run(
        Reconstructor(calibration, blank),
        None if built_from is None else built_from.gel,
        form=form,
        only_contact=part == "contact",
        mesh=mesh,
    )
    taken: set[str] = set()
    with unit_frames(where, calibration.unwarp, frames) as came, progress("point clouds") as show:
        for frame in came:
            if frame.image is None:
                continue
            stem = names[len(run.rows)] if names else _free_stem(frame, taken)
            path = out / f"{stem}.{form}"
            if not names:
                keep_inputs([unit, *where], [path])
            run.add(frame, path)
            show(len(run.rows) / max(len(where), len(run.rows) + 1), frame.name)
    print_rows(HEADINGS, [_cells(*told) for told in zip(run.shown, run.rows, strict=True)])
    named = None if built_from is None else built_from.name
    document = {"unit": str(unit), "form": form, "design": named}
    document |= first_touched(came, run.touched)
    remarks += run.doubts()
    write_json(json, document | {"clouds": run.rows, "remarks": [*remarks, *came.remarks]})
    for remark in remarks:
        print(remark, file=sys.stderr)
    came.tell()


class _Run:
    """Clouds, written frame after frame, and what is said of them."""

    def __init__(
        self,
        reconstruct: "Reconstructor",
        gel: "Gel | None",
        *,
        form: str,
        only_contact: bool,
        mesh: bool,
    ) -> None:
        self.rows: list[dict[str, Any]] = []
        """As in the JSON file."""
        self.shown: list[str] = []
        """The frames' names, for a table."""
        self.touched: list[tuple[int, int, bool]] = []
        """Number, time in ns and whether something touches, of each frame."""
        self._reconstruct, self._gel = reconstruct, gel
        self._form, self._only_contact, self._mesh = form, only_contact, mesh

    def add(self, frame: UnitFrame, path: Path) -> None:
        """Write the cloud of the next whole frame."""
        from recon.cloud import point_cloud, skin_mesh
        from recon.cloud_files import cloud_bytes
        from recon.contact.first_contact import touches
        from recon.plausible import cut_word, doubt_word

        assert frame.image is not None
        touch = self._reconstruct(frame.image)
        cloud = point_cloud(touch, self._gel)
        triangles = skin_mesh(touch, self._gel).triangles if self._mesh else None
        if self._only_contact:
            cloud = cloud[cloud.contact]
        write_atomic(path, cloud_bytes(cloud, self._form, triangles))
        unit = self._reconstruct.calibration
        remark = doubt_word(touch, unit) or cut_word(touch, unit) or None
        self.rows.append(_row(frame, touch, cloud) | {"file": str(path), "remark": remark})
        self.shown.append(frame.shown)
        shows = touches(touch.contact, touch.disturbed)
        self.touched.append((frame.number, frame.time_ns, shows))

    def doubts(self) -> list[str]:
        """Sentences on frames whose depth means little."""
        words = [row["remark"] or "" for row in self.rows]
        return doubt_remarks(list(zip(self.shown, words, strict=True)))


def _row(frame: UnitFrame, touch: "Reconstruction", cloud: "PointCloud") -> dict[str, Any]:
    """What is said of a frame and of its points in JSON."""
    import numpy as np

    from recon.contact.patches import contact_word

    patches, touching = touch.patches, int(touch.contact.sum())
    sigma_mm = float(np.median(cloud.sigma_mm)) if len(cloud) else np.nan
    return {
        "frame": frame.number,
        "image": frame.file or None,
        "points": len(cloud),
        "touching": touching,
        "contact": contact_word(patches),
        "patches": [asdict(patch) for patch in patches],
        "in_shadow": float(touch.shadow[touch.contact].mean()) if touching else 0.0,
        "deepest_mm": touch.deepest_mm,
        "sigma_mm": None if np.isnan(sigma_mm) else sigma_mm,
        "markers": touch.markers,
    }


def _cells(shown: str, row: dict[str, Any]) -> list[str]:
    """A row of the table, by the name that is shown of its frame."""
    return [
        shown,
        str(row["points"]),
        str(row["touching"]),
        str(row["contact"]),
        f"{row['in_shadow']:.0%}",
        f"{row['deepest_mm']:z.3f}",
        "–" if row["sigma_mm"] is None else f"{row['sigma_mm']:.4f}",
        str(row["markers"]),
        str(row["file"]),
    ]


def _is_cloud(path: Path, out: Path, form: str) -> bool:
    """Whether a file may be one of the clouds of a stream, which are named as its frames come."""
    return path.parent.resolve() == out.resolve() and path.suffix.lower() == f".{form}"


def _free_stem(frame: UnitFrame, taken: set[str]) -> str:
    """What the file to be written is called; of two images alike, the number sets one apart."""
    stem = output_names([frame.file or frame.name], [])[0]
    while stem in taken:
        stem += f"-{frame.name}"
    taken.add(stem)
    return stem
