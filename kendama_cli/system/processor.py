"""The kind of processor, by what decides how compiled code adds up: results are equal to the byte on one kind."""

from __future__ import annotations

from pathlib import Path

DECISIVE = ("avx", "fma", "sse4", "asimd", "sve", "neon", "vsx")
HEAD_BYTES = 8192


def processor() -> str:
    """Return the maker and the vector extensions of this machine's processor; empty where the system states none."""
    try:
        with Path("/proc/cpuinfo").open("rb") as stream:
            head = stream.read(HEAD_BYTES).decode(errors="replace")
    except OSError:
        return ""
    facts = dict(reversed([[part.strip() for part in line.partition(":")[::2]] for line in head.splitlines()]))
    flags = facts.get("flags", facts.get("Features", "")).split()
    maker = facts.get("vendor_id", facts.get("CPU implementer", ""))
    return " ".join([maker, *sorted(flag for flag in flags if flag.startswith(DECISIVE))]).strip()
