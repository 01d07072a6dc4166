"""Packed bytes of others, unpacked: their declared sizes are bounded before anything is allocated for them."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import zstandard


class OversizedError(ValueError):
    """More bytes are declared than are unpacked."""


MAX_ARRAYS_BYTES = 1 << 29
_WINDOW_BYTES = 1 << 27


def unpacked_arrays(data: bytes, most_bytes: int = MAX_ARRAYS_BYTES) -> dict[str, np.ndarray]:
    """Return the arrays of an ``.npz`` by name; raises ValueError for anything else, and beyond ``most_bytes``."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
        # of other methods zipfile unpacks whatever a piece of the file means, not what is asked for
        if any(one.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) for one in members):
            raise ValueError("packed by a method that numpy does not write")
        check_size(sum(one.file_size for one in members), most_bytes)
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return {name: np.asarray(arrays[name]) for name in arrays.files}
    except Exception as error:  # zipfile, zlib and numpy raise many kinds for a spoiled archive, and name none of them
        raise ValueError(f"{type(error).__name__}: {error}") from error


def unpacked_chunk(data: bytes, compression: str, size: int, most_bytes: int) -> bytes:
    """Return the content of an MCAP chunk that declares ``size`` bytes; raises ValueError where it has more.

    Raises ValueError, too, for a size beyond ``most_bytes`` and for a compression that MCAP does not know.
    """
    check_size(size, most_bytes)
    if compression == "":
        plain = data
    elif compression == "zstd":
        packed = zstandard.ZstdDecompressor(max_window_size=_WINDOW_BYTES)
        with packed.stream_reader(data, read_across_frames=True) as stream:
            plain = stream.read(size + 1)
    elif compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor  # noqa: PLC0415 - comes with mcap; our own logs need none

        try:
            plain = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        except RuntimeError as error:
            raise ValueError(str(error)) from None
    else:
        raise ValueError(f"compression '{compression}'; known: zstd, lz4")
    if len(plain) != size:
        raise ValueError(f"it has {'more' if len(plain) > size else 'fewer'} than the {size} bytes that it declares")
    return plain


def check_size(size: int, most_bytes: int) -> None:
    """Raise OversizedError where ``size`` is beyond ``most_bytes``."""
    if size > most_bytes:
        raise OversizedError(f"unpacked it would have {size / 1e6:.0f} MB; allowed: {most_bytes / 1e6:.0f} MB")
