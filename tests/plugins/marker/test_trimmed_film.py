"""A film of a marker that was trimmed is read as far as it is shown."""

from kendama_cli.plugins.marker.films import _frames
from kendama_cli.plugins.shared.videos.video import VideoFile
from tests.plugins.shared.test_video import frames, mp4, trimmed

__all__ = ["frames", "mp4"]


def test_a_filmed_marker_takes_a_trimmed_film_for_a_whole_one(mp4):
    trimmed(mp4, 8)
    assert len(list(_frames(str(mp4), None))) == VideoFile(mp4).count()
