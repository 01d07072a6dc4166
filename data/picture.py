"""Makes README's picture from the report of a default run: ``python data/picture.py PAGE [PICTURE]``.

    kendama run && kendama report -o page.html && python data/picture.py page.html

It shows the head of the page, the search for the time scale and what a camera saw, as Chromium draws them. The page's
headline figures stand in the picture's file as text, so that a test can hold them to a run's.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

KEYWORD = b"kendama figures"
WIDTH_PX, HEIGHT_PX = 1080, 1170
SHOWN = """<style>
main > *, section > * { display: none !important; }
main > .hero { display: grid !important; }
main > #adapt, main > #predict { display: block !important; border: 0; margin: 0; padding: 0; }
#adapt > figure:not(figure ~ figure), #predict > figure:not(figure ~ figure) { display: block !important; }
figcaption, .controls, .thumbs p { display: none !important; }
main { padding-top: 10px !important; margin-top: 0; }
</style></head>"""
"""What of the page is seen."""


def figures_of(page: str) -> dict[str, str]:
    """The headline figures at the head of a report, by their words."""
    found = re.findall(r"<div><dt>(.*?)</dt><dd>(.*?)</dd></div>", page[: page.find("<section")])
    return {html.unescape(words): html.unescape(re.sub("<.*?>", " ", value)).strip() for words, value in found}


def figures_in(picture: bytes) -> dict[str, str]:
    """The headline figures that stand in a picture's file."""
    start = picture.index(b"tEXt" + KEYWORD + b"\0")
    (length,) = struct.unpack(">I", picture[start - 4 : start])
    return dict(json.loads(picture[start + 4 : start + 4 + length].partition(b"\0")[2]))


def with_figures(picture: bytes, figures: dict[str, str]) -> bytes:
    """A PNG with the figures in a chunk of text before its end."""
    chunk = b"tEXt" + KEYWORD + b"\0" + json.dumps(figures).encode("ascii")
    end = picture.rindex(b"IEND") - 4
    return (
        picture[:end] + struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) + picture[end:]
    )


def drawn(page: str, folder: Path) -> bytes:
    """What Chromium draws of the page, as a PNG."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("the picture needs the program chromium (Debian: apt-get install chromium)")
    shown, picture = folder / "shown.html", folder / "picture.png"
    still = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)  # the film's poster is the moment of the catch
    shown.write_text(still.replace("</head>", SHOWN, 1), encoding="utf-8")
    options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
    size = f"--window-size={WIDTH_PX},{HEIGHT_PX}"
    subprocess.run([chromium, *options, size, f"--screenshot={picture}", shown.as_uri()], check=True, timeout=120)
    return picture.read_bytes()


def main(page_file: str, picture_file: str = str(Path(__file__).parent / "pictures" / "report.png")) -> None:
    page = Path(page_file).read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        Path(picture_file).write_bytes(with_figures(drawn(page, Path(folder)), figures_of(page)))


if __name__ == "__main__":
    main(*sys.argv[1:])
