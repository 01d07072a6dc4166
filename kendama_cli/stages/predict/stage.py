"""predict: cameras observe free flights, and the catching pose is predicted from their images."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.stages.interface import Made, StageContext
from kendama_cli.stages.predict.figures import FlightFigures, from_columns, made_of, to_columns
from kendama_cli.stages.predict.flight_study import FlightStudy
from kendama_cli.vision.settings import PredictSettings


class Predict:
    """Measures how well the crossing of the rim plane is predicted from images, against flights known exactly."""

    def __init__(
        self, *, predict: PredictSettings, camera: CameraSettings, game: GameSettings, lighting: LightingSettings
    ) -> None:
        self._settings, self._camera, self._game, self._lighting = predict, camera, game, lighting

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """The study of ``predict.flights`` flights; nothing is needed from other stages."""
        settings = self._settings
        study = FlightStudy(settings, self._camera, self._game, self._lighting, ctx=ctx)
        flights: list[FlightFigures] = []
        saved = ctx.restore()
        if saved is not None:
            flights = from_columns(saved)
            study.begin_s = float(saved["begin_s"])
        while len(flights) < settings.flights:
            flights.append(study.flight(len(flights)))
            ctx.checkpoint(partial(dict, to_columns(flights), begin_s=study.begin_s))
            stated = flights[-1].position_error_mm[settings.seen_fractions.index(settings.stated_fraction)]
            ctx.progress(len(flights), settings.flights, position_error_mm=float(stated))
        return made_of(settings, flights)
