# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge track`: where the touched object is, frame after frame."""

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app._first_contact import first_touched
from app._frames import UnitFrame, read_checked, unit_frames
from app._gel import laid_on
from app._growing_files import Growing, file_names, growing
from app._output import OutputFile, keep_inputs, print_table
from app._progress import progress
from app._remarks import background_remarks
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json

if TYPE_CHECKING:
    import numpy as np

    from recon.calibration import Calibration
    from recon.markers.tracking import Tracked
    from recon.pipeline import Reconstruction, Reconstructor
    from recon.pose.estimate import PoseEstimate
    from recon.pose.tracker import Tracker
    from sensor.design import Gel

DAMAGED, MISFIT = "the frame is damaged", "the frame is of another size than the unit's"
MOST_FRAMES = 250_000
"""Of one run, over two hours: a frame's row and pose stay in memory until its end, one or two
kilobytes; that there were more is said."""
COLUMNS = (
    "frame,time_ns,state,reason,x_mm,y_mm,z_mm,qx,qy,qz,qw,rotation_std_deg,translation_std_mm,"
    "overlap,explained,markers,image"
)


def main(
    unit: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="UNIT")],
    source: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="WHERE")],
    out: Path,
    tracker: Literal["joint", "gicp", "plane"] = "joint",
    mesh: Path | None = None,
    start: Path | None = None,
    design: str | None = None,
    background: str | None = None,
    begin: int = 0,
    frames: int | None = None,
    json: OutputFile = None,
) -> int:
    """Follow the pose of the object that a sensor touches.

    Without a mesh, the object is what the first touch shows. Its pose there is the identity, so
    poses tell how it has moved since. With a mesh in mm, poses are those of the mesh; if --start
    gives no first pose, and again after a loss, a touch is compared with the mesh from all sides,
    which takes seconds, and half a minute if the mesh has 300 000 triangles. A pose maps object
    coordinates to the gel frame: x along the columns, y down, z out of the gel.

    Every frame gets a state: tracking; weak (a pose, but the touch does not show every motion: a
    smooth ball does not show its rotation); frozen (the stream stands still); or lost, with the
    reason. A lost frame has no pose. A damaged frame is lost, too.

    OUT receives poses.csv, poses.png (with two standard deviations), overlay.webp, and poses.mcap
    for Foxglove and RViz: poses as transforms, their states, the touched points and a marker gel's
    dots.

    A dataset gives its blank frames, then its labelled presses or, if it has none, all its
    pictures. Ctrl-C or SIGTERM ends a stream, and the results so far are written. If the disk fills
    up, the run ends and reports which frames are kept, and the exit status is 2.

    Example: wedge track units/wedge-001 press.mp4 --background first --out tracked

    Args:
        unit: A unit folder, written by `wedge calibrate`.
        source: A video, a folder, a dataset, a recording (.mcap), usb:0 or http address.
        out: The folder for the results; new or empty.
        tracker: joint fits slopes and depth together; gicp and plane align point clouds, as the
            paper did.
        mesh: The object as STL, PLY or OBJ, in mm.
        start: The first pose: a text file of 4 x 4 numbers, T_sensor_object in mm.
        design: The design (standard, finger or FILE.toml) on whose curved gel the object travels;
            by default the unit's own if that is standard or finger, else the gel is flat.
        background: A blank frame taken today, or `first` if the source begins with one; by default
            the unit's own.
        begin: Skip this many frames: a light first touch represents the object poorly.
        frames: Stop after this many frames, at most 250 000; needed for a live source, which has no
            end.
        json: Write the poses, their covariances and the first contact here as JSON.
    """
    from recon.calibration import load_calibration
    from recon.pipeline import Reconstructor
    from validation.figures.png import png_bytes
    from validation.figures.tracking import pose_figure

    if frames is not None and not 0 < frames <= MOST_FRAMES:
        raise WedgeError(f"--frames must be 1 to {MOST_FRAMES}, not {frames}.")
    if begin < 0:
        raise WedgeError(f"--begin {begin} must be 0 or above.")
    check_outputs(*(out / name for name in file_names("poses")), json)
    keep_inputs([unit, source, mesh, start, design, background], [json])
    calibration = load_calibration(unit)
    built_from, said = laid_on(design, unit, calibration)
    gel = None if built_from is None else built_from.gel
    track = _tracker(tracker, mesh, start, gel)
    blank = None
    if background not in (None, "first"):
        blank = read_checked(background, calibration.unwarp)
    with (
        unit_frames([source], calibration.unwarp, begin + (frames or MOST_FRAMES + 1)) as came,
        growing(out, "poses", COLUMNS, gel) as files,
        progress("tracking") as show,
    ):
        if came.live and frames is None:
            raise WedgeError(f"{source} has no end: limit the number of frames with --frames.")
        run, reconstruct = _Run(track, files, gel, apart=came.apart), None
        for index, frame in enumerate(came):
            if index == 0 and background == "first":
                if frame.image is None:
                    raise WedgeError(f"{source} does not begin with a blank frame: {frame.flaw}")
                blank = frame.image
            if index < begin:
                continue
            if len(run.found) == MOST_FRAMES:
                said.append(_cut(begin))
                break
            if reconstruct is None:
                reconstruct = Reconstructor(calibration, blank)
                said += background_remarks(
                    calibration,
                    blank,
                    "The first frame" if background == "first" else str(background),
                )
            run.add(frame, reconstruct)
            if files.failed:
                break
            show(len(run.found) / (frames or len(run.found) + 1), run.found[-1].state)
        if came.interrupted and files.clip.empty:
            came.give_up()
        if not run.found:
            raise WedgeError(f"{source} holds no frame" + (f" {begin}." if begin else "."))
        if files.clip.empty:
            raise WedgeError(f"{source} holds no whole frame from {begin} on.")
        figure = pose_figure(run.times_s, run.found, Path(source).name)
        span = f"Frames {run.rows[0][0]} to {run.rows[-1][0]}"
        said += files.finish(png_bytes(figure), span, f" Continue with --begin {index}.")
    _print_states(run.found)
    poses = run.poses()
    _print_misfits([pose["markers"] for pose in poses])
    first = first_touched(came, run.touched)
    if (out / "overlay.webp").exists():
        print(f"Open {out / 'overlay.webp'}")
    for sentence in said:
        print(sentence, file=sys.stderr)
    named = None if built_from is None else built_from.name
    document = {"unit": str(unit), "source": source, "tracker": tracker, "design": named} | first
    write_json(json, {**document, "poses": poses, "remarks": [*came.remarks, *said]})
    came.tell()
    return 2 if files.failed else 0


class _Run:
    """What was found frame after frame, written as it comes."""

    def __init__(self, track: "Tracker", files: Growing, gel: "Gel | None", *, apart: bool) -> None:
        self.found: list[PoseEstimate] = []
        self.rows: list[list[Any]] = []
        """As in the table."""
        self.touched: list[tuple[int, int, bool]] = []
        """Number, time in ns and whether something touches, of each whole frame."""
        self._track, self._files, self._gel, self._apart = track, files, gel, apart
        self._dots: Tracked | None = None
        """Of the frame before, where frames follow each other."""
        self._anchor: np.ndarray | None = None

    def add(self, frame: UnitFrame, reconstruct: "Reconstructor") -> None:
        """Take in the next frame, unless it cannot be written."""
        from recon.contact.first_contact import touches

        before = None if self._apart else self._dots
        touch = None if frame.image is None else reconstruct(frame.image, before)
        self._dots = self._dots if touch is None else touch.dots
        pose = _pose_in(frame, touch, self._track, reconstruct.calibration)
        row = _row(frame, pose, "" if touch is None else touch.markers)
        with self._files.writing():
            if touch is None:
                self._files.recording.add_pose(frame.time_ns, pose)
            else:
                self._files.recording.add(frame.time_ns, touch, pose, touch.dots)
            self._files.table.add(row)
        if self._files.failed:
            return
        if touch is not None and frame.image is not None:
            self._draw(reconstruct.unwarp(frame.image), touch, pose)
        self.found.append(pose)
        self.rows.append(row)
        if touch is not None:
            shows = touches(touch.contact, touch.disturbed)
            self.touched.append((frame.number, frame.time_ns, shows))

    def _draw(self, image: "np.ndarray", touch: "Reconstruction", pose: "PoseEstimate") -> None:
        """The next picture of the clip."""
        from validation.figures.tracking import anchor_on, overlay

        if self._anchor is None and pose.T_sensor_object is not None:
            self._anchor = anchor_on(touch, pose.T_sensor_object, self._gel)
        picture = overlay(image, touch.contact, touch.mm_per_px, pose, self._anchor)
        self._files.clip.add(picture)

    @property
    def times_s(self) -> list[float]:
        """Since the first frame."""
        return [(row[1] - self.rows[0][1]) / 1e9 for row in self.rows]

    def poses(self) -> list[dict[str, Any]]:
        """The rows with their covariances, for a JSON file."""
        return [
            dict(zip(COLUMNS.split(","), row, strict=True)) | {"covariance": _covariance(pose)}
            for row, pose in zip(self.rows, self.found, strict=True)
        ]


def _tracker(name: str, mesh: Path | None, start: Path | None, gel: "Gel | None") -> "Tracker":
    from recon.pose.mesh import read_mesh
    from recon.pose.models import MeshModel
    from recon.pose.tracker import REGISTRATIONS, Tracker

    model = None
    if mesh is not None:
        model = MeshModel(mesh=read_mesh(mesh), registration=REGISTRATIONS[name])
    return Tracker(name, model, None if start is None else _pose(start), gel)


def _pose_in(
    frame: UnitFrame, touch: "Reconstruction | None", track: "Tracker", unit: "Calibration"
) -> "PoseEstimate":
    """What a frame says of the pose, with all that is known of the frame."""
    from recon.follower import doubted, followed
    from recon.plausible import doubt_word
    from recon.pose.estimate import PoseEstimate

    if touch is None:
        return PoseEstimate(state="lost", reason=MISFIT if frame.misfit else DAMAGED)
    doubt = doubt_word(touch, unit)
    found = followed(track, touch, doubt)
    return doubted(found, touch.markers, still=frame.still, doubt=doubt)


def _print_states(found: "Sequence[PoseEstimate]") -> None:
    counts = Counter((item.state, item.reason) for item in found)
    print_table(
        ["state", "why", "frames"],
        [[state, reason, str(count)] for (state, reason), count in counts.most_common()],
    )


def _print_misfits(markers: Sequence[str]) -> None:
    """What is wrong with the dots, by the words of all frames."""
    from recon.follower import TRUSTED_MARKERS

    misfit = Counter(word for word in markers if word and word not in TRUSTED_MARKERS)
    for word, count in misfit.most_common():
        print(f"The dots on the gel, in {count} of {len(markers)} frames: {word}")


def _cut(begin: int) -> str:
    """What is said where a source goes on after the last frame that one run follows."""
    end = begin + MOST_FRAMES
    return (
        f"Frames {begin} to {end - 1} were followed, the most that one run can, and more came: "
        f"continue with --begin {end}."
    )


def _pose(path: Path) -> "np.ndarray":
    """A transform from a text file."""
    import numpy as np

    from recon.pose.rigid import rigid_or_none

    try:
        numbers = np.array(path.read_text(encoding="utf-8").replace(",", " ").split(), float)
    except (OSError, ValueError) as error:
        raise WedgeError(f"{path} does not hold 16 numbers: {error}.") from error
    if numbers.size != 16:
        raise WedgeError(f"{path} holds {numbers.size} numbers, not the 16 of a 4 x 4 pose.")
    pose = rigid_or_none(numbers.reshape(4, 4))
    if pose is None:
        raise WedgeError(f"{path} is not a rigid transform: give a 4 x 4 [R t; 0 0 0 1], t in mm.")
    return pose


def _row(frame: UnitFrame, item: "PoseEstimate", markers: str) -> list[Any]:
    """The cells of one frame; ``None`` for what is not known."""
    from scipy.spatial.transform import Rotation

    pose: list[float | None] = [None] * 9
    if item.T_sensor_object is not None:
        quaternion = Rotation.from_matrix(item.T_sensor_object[:3, :3]).as_quat()
        numbers = [*item.T_sensor_object[:3, 3], *quaternion]
        spread = [item.rotation_std_deg, item.translation_std_mm]
        pose = [round(float(value), 7) for value in (*numbers, *spread)]
    shares = [round(item.overlap, 3), round(item.explained, 3)]
    told = [item.state, item.reason, *pose, *shares, markers]
    return [frame.number, frame.time_ns, *told, frame.file or None]


def _covariance(item: "PoseEstimate") -> list[float] | None:
    """The upper triangle, row by row, by x, y, z in mm and turns about them in rad.

    ROS too has shifts before turns; a twist has them the other way round.
    """
    import numpy as np

    if item.covariance is None:
        return None
    order = [3, 4, 5, 0, 1, 2]
    covariance = item.covariance[np.ix_(order, order)]
    return [float(f"{value:.6g}") for value in covariance[np.triu_indices(6)]]
