"""Export of the peak speeds as plain text."""

from pathlib import Path

import kendama_cli as kendama
from kendama_cli.extension import UsageError


def export_peaks(request):
    if request.topic is not None:
        raise UsageError("--format peaks takes no --topic: it reads /tempo/scale alone")
    speeds = kendama.open_run(home=request.home).log(request.place).table("/tempo/scale")["peak_speed_m_s"]
    output = request.output or Path("peaks.txt")
    output.write_text("\n".join(f"{speed:.3f}" for speed in speeds) + "\n")
    return [output]
