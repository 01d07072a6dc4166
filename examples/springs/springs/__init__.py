"""Declaration of the controller."""

from kendama_cli.extension import Variant

CONTROLLER = Variant("springs", settings="springs.settings:ControllerSettings", makes="springs.controller:Controller")
