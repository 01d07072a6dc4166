"""The one import of DART: where its system library is missing, one line says what brings it."""

from __future__ import annotations

from kendama_cli.errors import MissingPartError

try:
    import dartpy
except ImportError as error:  # the wheel links against libGL although nothing here draws
    if "libGL" in str(error):
        raise MissingPartError(
            "libGL.so.1", "the simulator DART needs the system library libGL.so.1: apt-get install libgl1"
        ) from error
    raise MissingPartError("dartpy", f"the simulator DART cannot be loaded ({error}): pip install dartpy") from error

__all__ = ["dartpy"]
