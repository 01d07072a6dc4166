"""Commands of the bench."""

from typing import Annotated

import typer


def peaks(run: Annotated[str | None, typer.Argument(help="Id of a run; the newest if left out.")] = None) -> None:
    """Print the peak speeds of the stage tempo."""
    import kendama_cli as kendama  # heavy imports stand inside the function

    for _, row in kendama.open_run(run).log("tempo").table("/tempo/scale").iterrows():
        print(f"tau x {row['tau_scale']:.1f}: {row['peak_speed_m_s']:.2f} m/s")
