# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A design to the folder that a workshop needs, for `wedge fabricate` and `wedge reproduce`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from app._progress import progress
from app._workers import process_pool
from sensor.design import Wedge
from sensor.documents import json_bytes
from sensor.errors import WedgeError
from sensor.extras import how_to_install
from sensor.files import new_folder

if TYPE_CHECKING:
    from cad.build import Model

MANIFEST = "manifest.json"


class MissingExtraError(WedgeError):
    """The packages that make solids are not installed."""


def fabricate(wanted: Wedge, folder: Path, *, again: bool = False) -> dict[str, Any]:
    """Write a design's folder, whole or not at all, and return its manifest without the hashes.

    Args:
        wanted: the design.
        folder: a new or empty folder.
        again: replace a folder that an earlier run has written.

    Raises:
        MissingExtraError: a package of the extra cad is not installed.
        WedgeError: the design cannot be built, or the folder cannot be written.
    """
    title = f"fabrication of {wanted.name}"
    over = MANIFEST if again else None
    with progress(title) as show, new_folder(folder, over=over) as draft:
        show(0.0, "loading the solid modeller")
        try:
            from cad.build import manifest_of, model, run_checks, write_files, write_pictures
        except ModuleNotFoundError as error:
            raise MissingExtraError(
                f"fabricate needs {error.name}: {how_to_install('cad')}."
            ) from error
        except ImportError as error:  # a library of the system, such as libGL.so.1
            raise WedgeError(
                f"fabricate cannot load the solid modeller ({error}); on Debian, install it with "
                "`apt-get install libegl1 libgl1`."
            ) from error

        show(0.1, "building parts")
        built = model(wanted)
        with process_pool() as pool:
            finish_pictures = write_pictures(built, draft, pool)
            show(0.25, "writing files")
            write_files(built, draft)
            show(0.35, "checking")
            manifest = manifest_of(built, run_checks(built))
            show(0.6, "drawing pictures")
            finish_pictures()
        show(0.95, "writing bill, guide and manifest")
        _write_papers(built, manifest, draft)
    return manifest


def _write_papers(built: "Model", manifest: dict[str, Any], folder: Path) -> None:
    """The bill, the guide, the page, and last the manifest with the hash of every file."""
    from bom.bill import bill_csv, bill_markdown, distributor_csv, make_bill, read_parts
    from bom.fit import parts_for
    from cad.exports.page import guide_html, page_html
    from cad.guide import guide_text, part_names
    from cad.manifest import with_hashes

    lines = make_bill(manifest["bill"], parts_for(built.design, read_parts()))
    billed = {line.part.id: line.part.name for line in lines}
    names = part_names(manifest["parts"], billed)
    title = f"GelSight Wedge, {built.design.name}"
    order = [(line.part.name, line.quantity_words) for line in lines]
    failed = [f"{c['check']} {c['subject']}" for c in manifest["checks"] if not c["passed"]]
    guide = guide_text(built.design, built.assembly, built.boards, manifest, names, order, failed)
    texts = {
        "bill/bill.csv": bill_csv(lines),
        "bill/bill.md": bill_markdown(lines, title),
        "bill/distributor.csv": distributor_csv(lines),
        "bill/distributor_for_10.csv": distributor_csv(lines, 10),
        "guide.md": guide,
        "guide.html": guide_html(guide),
    }
    for name, text in texts.items():
        target = folder / name
        target.parent.mkdir(exist_ok=True)
        target.write_text(text, encoding="utf-8", newline="\n")
    paths = sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    steps = [step.title for step in built.assembly.steps]
    page = page_html(built.design, manifest, names, steps, paths)
    (folder / "index.html").write_text(page, encoding="utf-8", newline="\n")
    (folder / MANIFEST).write_bytes(json_bytes(with_hashes(manifest, folder)))
