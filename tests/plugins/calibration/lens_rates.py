"""Rates at which views of another lens are told, and good sets are not, on fresh renders.

    python -m tests.plugins.calibration.lens_rates TABLE.csv [SETS [MINUTES]]

For each of SETS there is a good set of 9 to 16 views, one of 16 with six of another zoom, and one with two of a like
camera. What stands in the table is left out, and after MINUTES nothing further is begun. The last lines count what was
told.
"""

from __future__ import annotations

import csv
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

from tests.plugins.calibration.board_views import camera
from tests.plugins.calibration.test_one_lens import AT, check, seen

GOOD_SEED, MIXED_SEED, STEP = 60_000, 70_000, 100
FOREIGN = {"six of another zoom": (1.25, (0.0, 0.0), 6), "two of a like camera": (1.01, (-8.0, 7.0), 2)}
"""Focal length over that of the others, the centre's shift [px], and how many of the 16 views."""


def told(kind: str, number: int) -> bool:
    """Return True if the set is refused."""
    one = camera("left", AT)
    if kind in FOREIGN:
        focal, centre_px, foreign = FOREIGN[kind]
        other = replace(one, focal_px=one.focal_px * focal, center_px=one.center_px + centre_px)
        views = seen([one] * (16 - foreign) + [other] * foreign, MIXED_SEED + STEP * number)
    else:
        views = seen([one] * (9 + number % 8), GOOD_SEED + STEP * number)
    try:
        check(views)
    except ValueError:
        return True
    return False


def main() -> None:
    """Fill the table, and count."""
    path = Path(sys.argv[1])
    sets, minutes = (float(sys.argv[at]) if len(sys.argv) > at else other for at, other in ((2, 50.0), (3, 600.0)))
    end_s = time.monotonic() + 60 * minutes
    if not path.exists():
        path.write_text("kind,number,told\n")
    there = {(one["kind"], one["number"]) for one in csv.DictReader(path.open())}
    for number in range(int(sets)):
        for kind in (*FOREIGN, "good"):
            if (kind, str(number)) not in there and time.monotonic() < end_s:
                row = (kind, number, int(told(kind, number)))
                with path.open("a") as file:
                    csv.writer(file, lineterminator="\n").writerow(row)
    made = list(csv.DictReader(path.open()))
    counts = Counter(one["kind"] for one in made)
    for kind, count in counts.items():
        print(f"{kind}: told in {sum(int(one['told']) for one in made if one['kind'] == kind)} of {count}")


if __name__ == "__main__":
    main()
