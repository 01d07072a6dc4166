"""The demonstrators that come with kendama, as declarations for the entry point group ``kendama.demonstrators``.

``makes`` is called with its settings and returns a sequence of Demonstrator, one per demonstration, in order.
Where the settings have ``streams: ClassVar[bool] = True`` it is called with a second argument, the Tell that reports
the progress of the stream (see live_figures).
"""

from kendama_cli.schema.registry import Variant

FILE = Variant(
    "file",
    settings="kendama_cli.devices.demonstrator.settings:FileCapture",
    makes="kendama_cli.devices.demonstrator.file:open_files",
)
