"""Settings of a log that another version wrote."""

from pathlib import Path

import pytest

from kendama_cli.errors import InputError
from kendama_cli.log.logged_settings import logged_settings
from kendama_cli.settings.game import GameSettings
from tests.shipped_conf import configured, plain


def test_settings_are_as_they_were_logged() -> None:
    assert logged_settings(GameSettings, plain("game", "kendama"), "game", Path("log.mcap")) == configured(
        GameSettings, "game", "kendama"
    )


def test_settings_of_another_version_name_the_log_and_what_differs() -> None:
    older = {**plain("game", "kendama"), "rope": {"length_m": 0.4}}
    with pytest.raises(
        InputError, match=r"^log.mcap: its settings 'game' are of another version \(.*game.rope.*again$"
    ):
        logged_settings(GameSettings, older, "game", Path("log.mcap"))
