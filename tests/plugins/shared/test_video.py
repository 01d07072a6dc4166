"""Films with faults: what is known of them is used, and what is wrong is told."""

import struct

import av
import numpy as np
import pytest

from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.videos.video import VideoFile, read_avi, video_faults
from kendama_cli.plugins.shared.videos.views import read_views
from tests.vision.ball_films import RATE_HZ, pendulum, textured, write_film

FRAMES = 24


@pytest.fixture(scope="module")
def frames():
    return pendulum(FRAMES, 10310, background=textured(10311))[0]


@pytest.fixture
def avi(frames, tmp_path):
    write_film(tmp_path / "film.avi", frames)
    return tmp_path / "film.avi"


@pytest.fixture
def mp4(frames, tmp_path):
    write_film(tmp_path / "film.mp4", frames, "mp4v")
    return tmp_path / "film.mp4"


def changed(path, place, content):
    data = bytearray(path.read_bytes())
    data[place : place + len(content)] = content
    path.write_bytes(data)


def faults(path):
    film = VideoFile(path)
    return list(video_faults(film, film.times_s()))


def test_a_whole_video_has_no_faults(avi, mp4):
    assert faults(avi) == faults(mp4) == []
    facts = read_avi(avi)
    assert (facts.rate_hz, facts.frames, facts.damaged_byte) == (RATE_HZ, FRAMES, None)
    assert read_avi(mp4) is None
    assert np.allclose(VideoFile(avi).times_s(), np.arange(FRAMES) / RATE_HZ, atol=1e-6)


@pytest.mark.parametrize("what", ["zeros", "noise", "length"])
def test_an_avi_ends_where_it_is_damaged(avi, what):
    """After it FFmpeg finds further frames, but counts on from the last one before: their times would be wrong."""
    data = avi.read_bytes()
    start, found = data.index(b"movi"), []
    while (start := data.find(b"00dc", start + 1)) > 0 and len(found) < FRAMES:
        found.append(start)
    hurt = {
        "zeros": (found[10] + 3000, bytes(30_000)),
        "noise": (found[10] + 3000, np.random.default_rng(10312).integers(0, 256, 30_000, dtype=np.uint8).tobytes()),
        "length": (found[11] + 4, struct.pack("<I", 0x7FFFFFFF)),
    }
    changed(avi, *hurt[what])
    (line,) = faults(avi)
    assert f"it is damaged at byte {found[11]}, after 11 of its {FRAMES} frames; an AVI does not say when" in line
    assert np.allclose(VideoFile(avi).times_s(), np.arange(11) / RATE_HZ, atol=1e-6)


def test_a_video_that_is_cut_off_is_reported_and_its_first_part_used(avi, mp4):
    avi.write_bytes(avi.read_bytes()[: avi.stat().st_size // 2])
    (line,) = faults(avi)
    assert f" of its {FRAMES} frames can be read: it is cut off or damaged; copy it again" in line
    assert FRAMES // 3 < VideoFile(avi).count() < FRAMES * 2 // 3
    mp4.write_bytes(mp4.read_bytes()[: mp4.stat().st_size // 2])
    with pytest.raises(InputError, match=r"film.mp4: it is cut off: its index \(moov\) is not there; copy it again"):
        VideoFile(mp4)


@pytest.mark.parametrize(("scale", "rate", "told"), [(1, 0, "0"), (0, 0, "0"), (1000, 1, "0.001"), (1, 9999, "9999")])
def test_an_avi_without_a_frame_rate_is_refused(avi, scale, rate, told):
    """FFmpeg takes 25 frames a second where the header says none."""
    changed(avi, avi.read_bytes().index(b"strh") + 28, struct.pack("<II", scale, rate))
    with pytest.raises(InputError, match=f"its header says {told} frames per second, so its times are not known"):
        VideoFile(avi)


def test_frames_that_are_not_evenly_spaced_are_reported(mp4):
    times_s = np.delete(np.arange(FRAMES) / RATE_HZ, [5, 12, 13])
    (line,) = [one for one in video_faults(VideoFile(mp4), times_s) if "evenly" in one]
    assert "its frames are not evenly spaced (33.3 ms, but 2 gaps of up to 100 ms): each has its own time" in line


def turn(path, a, b, c, d):
    """Have the metadata say that the film is to be turned: the matrix of ISO 14496-12's track header."""
    place = path.read_bytes().index(b"tkhd") + 4 + 40
    one = 0x10000
    changed(path, place, struct.pack(">9i", a * one, b * one, 0, c * one, d * one, 0, 0, 0, 0x40000000))


def turn_on_its_side(path):
    turn(path, 0, 1, -1, 0)


def test_a_video_that_its_metadata_rotates_is_rotated_and_says_so(mp4):
    assert (VideoFile(mp4).turned_deg, VideoFile(mp4).width_px) == (0, 320)
    turn_on_its_side(mp4)
    film = VideoFile(mp4)
    assert film.turned_deg in (90, 270)
    assert (film.width_px, film.height_px) == (240, 320)


UNMIRRORED = {  # the matrix (a, b, c, d) of x' = a x + c y, y' = b x + d y, and quarter turns of NumPy's rot90
    "upright": ((1, 0, 0, 1), 0),
    "clockwise": ((0, 1, -1, 0), -1),
    "upside down": ((-1, 0, 0, -1), 2),
    "anticlockwise": ((0, -1, 1, 0), 1),
}


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("name", UNMIRRORED)
def test_each_of_eight_matrices_shows_the_video_upright_as_the_lens_saw_it(mp4, name, mirrored):
    taken = next(VideoFile(mp4).frames())[1]
    (a, b, c, d), quarters = UNMIRRORED[name]
    if mirrored:  # first flipped from left to right: x' = -a x + c y
        a, b = -a, -b
    turn(mp4, a, b, c, d)
    film = VideoFile(mp4)
    np.testing.assert_array_equal(next(film.frames())[1], np.rot90(taken, quarters))
    assert (film.is_mirrored, film.turned_deg) == (mirrored, -90 * quarters % 360)
    lines = faults(mp4)
    assert len([line for line in lines if "it is rotated by" in line]) == (quarters != 0)
    assert len([line for line in lines if "mirrors it, which is left out" in line]) == mirrored


def trimmed(path, frames):
    """Have the edit list show the ``frames`` from the middle on: ISO 14496-12's box 'elst' with one entry."""
    data = path.read_bytes()
    ticks_per_s = struct.unpack(">I", data[data.index(b"mvhd") + 16 :][:4])[0]
    place = data.index(b"elst") + 12
    (since,) = struct.unpack(">i", data[place + 4 : place + 8])
    media_per_s = struct.unpack(">I", data[data.index(b"mdhd") + 16 :][:4])[0]
    begun = since + round(media_per_s * (FRAMES // 2) / RATE_HZ)
    changed(path, place, struct.pack(">Ii", round(ticks_per_s * frames / RATE_HZ), begun))


def test_a_trimmed_video_is_read_as_far_as_it_is_shown_and_is_not_damaged(mp4):
    trimmed(mp4, 8)
    with av.open(str(mp4)) as opened:
        shown = sum(1 for _ in opened.decode(video=0))
    film = VideoFile(mp4)
    assert (film.count(), film.declared) == (shown, FRAMES)
    assert 6 <= shown <= 12
    (line,) = faults(mp4)
    assert "it is trimmed: its edit list shows about" in line
    assert f"of its {FRAMES} frames" in line
    assert len(list(read_views([mp4]))) == shown
