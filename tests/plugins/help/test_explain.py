"""``kendama explain``: every setting, metric, topic and figure has a sentence that a reader understands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import kendama_cli
from kendama_cli.plugins.help.explain import all_settings, declarations
from kendama_cli.schema.setting_facts import sentence
from tests.cli.typed import kendama, refused

PACKAGE = Path(kendama_cli.__file__).parent
BANNED = {*"what whether how where which when those of as by from its to for".split()}  # noqa: SIM905
PARTS = [
    PACKAGE / "stages",
    PACKAGE / "plugins/bench",
    PACKAGE / "plugins/identification",
    PACKAGE / "plugins/interact",
    PACKAGE / "plugins/mujoco",
    PACKAGE / "plugins/offline",
    PACKAGE / "plugins/rehearsal",
    PACKAGE / "report",
]
SENTENCES = {
    **{f"{one.name} {name}": words for one in declarations() for name, words in one.metrics.items()},
    **{name: words for one in declarations() for name, words in (*one.topic_words.items(), *one.figures.items())},
    **{one.key: sentence(one.field) for one in all_settings()},
}


def test_every_setting_metric_topic_and_figure_has_a_sentence() -> None:
    assert len(SENTENCES) > 700
    wrong = {
        name: words
        for name, words in SENTENCES.items()
        if not words.endswith(".") or len(words) < 6 or re.split(r"\W+", words)[0].lower() in BANNED
    }
    assert wrong == {}


def test_the_declared_text_of_a_setting_is_short_sentences_in_words_of_the_field() -> None:
    """A machine sees no verb; it sees a fragment by its first letter and its end, and words that only we use."""
    texts = {str(one.field.metadata.get("doc", "")): one.key for one in all_settings()}
    assert {key: text for text, key in texts.items() if not (text[:1].isupper() and text.endswith("."))} == {}
    house = re.compile(r"\b(worlds|drawn|toys?|nobody|films?|(?<!at )least|tempo|proof)\b", re.IGNORECASE)
    assert [text for text in (*texts, *SENTENCES.values()) if house.search(text)] == []
    assert [text for text in texts if any(len(one.split()) > 40 for one in text.split(". "))] == []


def test_the_topics_with_a_sentence_are_those_that_a_stage_logs() -> None:
    for one in declarations():
        assert set(one.topic_words) == set(one.topics), one.name


def test_every_figure_that_is_drawn_has_a_sentence() -> None:
    """The names stand in calls of ``drawing`` and of panels that pass them on."""
    explained = {name for one in declarations() for name in one.figures}
    source = "\n".join(path.read_text() for part in PARTS for path in part.rglob("*.py"))
    stages = "|".join([one.name for one in declarations()] + ["sweep", "compare"])
    call = r'(?:drawing|_panel)\(\s*(?:[^"()]|\([^()]*\))*?'
    drawn = set(re.findall(rf'{call}"((?:{stages})-[a-z]+)"', source))
    assert len(drawn) > 30
    assert drawn <= explained
    assert {name for name in explained if f'"{name}"' not in source} <= {
        *(f"{stage}-{unit}" for stage in ("predict", "compare") for unit in ("mm", "ms")),
        *(f"rehearse-{name}" for name in ("behind", "apart")),
    }


def test_every_metric_that_a_report_or_table_reads_has_a_sentence() -> None:
    for one in declarations():
        folder = PACKAGE / ("stages" if (PACKAGE / "stages" / one.name).is_dir() else "plugins") / one.name
        source = "\n".join(path.read_text() for path in folder.glob("*.py"))
        read = set(re.findall(r'\.metrics(?:\.get\(|\[)"(\w+)"', source)) | {head.metric for head in one.headline}
        assert read - {"warnings"} <= set(one.metrics), one.name


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (
            "learn.alpha",
            ["(setting)", "number, > 0", "0.7, in conf/learn/sarsa.yaml", "reruns    learn, transfer"],
        ),
        ("game.rope.length_m", ["(setting)", "unit      m", "in conf/game/kendama.yaml", "reruns    "]),
        ("learn.learner.gain", ["energy_pumping", "With the energy E of the"]),
        ("alpha", ["learn.alpha (setting)"]),
        ("adapt.success_rate", ["adapt.success_rate (metric)", "1 is best", "stage     adapt"]),
        ("tracking_rms_mm_after", ["unit      mm"]),
        ("s1_rms_nm", ["unit      N m"]),
        ("adapt", ["adapt (stage)", "returns   CatchMotion", "tau_windows", "/adapt/window"]),
        ("/adapt/window", ["(topic)", "fields    index, low"]),
        ("/predict/image/left", ["(topic)", "/predict/image/*"]),
        ("adapt-search", ["(figure)", "stage     adapt"]),
        ("robot", ["(group)", "robot=ur5"]),
        ("learn.learner", ["learn/learner (group)", "learn/learner=random_replay"]),
        ("seed", ["seed (setting)"]),
    ],
)
def test_a_name_is_explained_by_its_declaration(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, told: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = kendama(capsys, "explain", name)
    assert code == 0
    assert [one for one in told if one not in out] == []
    assert max(map(len, out.splitlines())) <= 80


def test_a_name_that_is_not_there_gets_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert "type kendama explain success_rate" in refused(capsys, "explain", "succes_rate")
    assert "type kendama explain learn.alpha" in refused(capsys, "explain", "learn.alhpa")
    assert "type kendama explain tau_scale" in refused(capsys, "explain", "tau")
    assert "'kendama config' prints all keys" in refused(capsys, "explain", "zzzz")


def test_several_names_are_explained_in_their_order(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = kendama(capsys, "explain", "tau_scale", "learn.alpha")
    assert code == 0
    assert out.index("adapt.tau_scale (metric)") < out.index("learn.alpha (setting)")
