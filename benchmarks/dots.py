# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots in real frames: followed on marker gels, and told where the blank frame has or shows none.

    python -m benchmarks.dots marker-balls-a wedge-mit-bolt

Of a set whose blank frame shows dots: how many dots its other frames have in all, each sought from
rest; how many are not seen; the words on the frames; by what share of their distance neighbours'
shifts differ at most; and in how many frames unexpected dots are told if the blank frame's are
filled in. Of other sets: in how many frames dots are told. Frames are all pictures of a set, of a
clip every fifth.
"""

import argparse
from collections import Counter
from collections.abc import Iterator

import numpy as np
from scipy.spatial import KDTree

from recon.arrays import Unwarped
from recon.images import read_frame
from recon.markers.detection import unexpected_dots
from recon.markers.filling import fill_gradients
from recon.markers.tracking import NEIGHBORS, MarkerTracker, Tracked
from recon.picture_names import picture_names
from recon.presses import PressReader, press_reader
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder


def frames(reader: PressReader) -> Iterator[Unwarped]:
    """Every frame of a set but its blank ones."""
    dataset = reader.dataset
    files = dict.fromkeys(
        [*(label.file for label in dataset.labels), *picture_names(dataset.folder)]
    )
    for file in files:
        if file not in dataset.card.background:
            yield reader.unwarped(file, read_frame(dataset.folder, file))


def on_marker_gel(reader: PressReader, dots: MarkerTracker) -> str:
    """What is seen of the dots of all frames."""
    bare = fill_gradients(reader.blank, dots.hidden(), "harmonic")
    words, seen, count, told, apart = Counter[str](), 0, 0, 0, 0.0
    for image in frames(reader):
        tracked = dots.track(image)
        words[tracked.word] += 1
        seen, count = seen + int(tracked.seen.sum()), count + len(tracked.seen)
        apart = max(apart, most_apart(tracked))
        told += bool(unexpected_dots(image, bare))
    spoken = ", ".join(f"{number} {word}" for word, number in words.items())
    return (
        f"{words.total()} frames: {count - seen} of {count} dots not seen; {spoken}; neighbours' "
        f"shifts differ by {apart:.2f} of their distance at most; unexpected dots are told in "
        f"{told} if the blank frame's are filled in"
    )


def most_apart(tracked: Tracked) -> float:
    """How much shifts of two seen neighbours differ, over their distance or the spacing."""
    rest, moved = tracked.markers.position_px, tracked.displacement_px
    away_px, near = (found[:, 1:] for found in KDTree(rest).query(rest, k=NEIGHBORS + 1))
    both = tracked.seen[:, None] & tracked.seen[near]
    differ_px = np.linalg.norm(moved[:, None] - moved[near], axis=-1)
    return float((differ_px / np.maximum(away_px, tracked.markers.spacing_px))[both].max(initial=0))


def on_clear_gel(reader: PressReader) -> str:
    """In how many frames dots are told."""
    told = [bool(unexpected_dots(image, reader.blank)) for image in frames(reader)]
    return f"{len(told)} frames: none on the blank one, dots are told in {sum(told)}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.dots", description=__doc__)
    parser.add_argument("datasets", nargs="+", help="such as wedge-lab; see `wedge data list`")
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        for dataset in [read_dataset(dataset_folder(name)) for name in options.datasets]:
            reader = press_reader(dataset)
            dots = reader.dots
            said = on_clear_gel(reader) if dots is None else on_marker_gel(reader, dots)
            print(f"{dataset.card.name}, {said}", flush=True)


if __name__ == "__main__":
    main()
