"""Chapter of the report, drawn from the log alone."""

from bench.tempo.messages import TempoMessage
from kendama_cli.extension import Figure, Panel, drawing


def figures(log):
    table = log.table("/tempo/scale", TempoMessage)
    with drawing("tempo", "Peak speed over the time scale") as drawn:
        (axes,) = drawn.axes()
        axes.plot(table["tau_scale"], table["peak_speed_m_s"], marker="o")
        axes.axhline(log.setting("tempo", "allowed_m_s"), linestyle="--")
        axes.set(xlabel="time scale tau", ylabel="peak speed [m/s]")
    return [
        Figure("Peak speed of the cup over the time scale; the dashed line is the limit.", (Panel("Tempo", drawn.svg),))
    ]
