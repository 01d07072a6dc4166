"""The figures and tables of a report as files: the same bytes again, the data behind them, nothing missing."""

from __future__ import annotations

import csv
import io
import re
import shutil
import subprocess
from xml.etree import ElementTree

import pytest

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.log.messages import RolloutMessage
from kendama_cli.plugins.publication.files import COLUMN_MM, PAGE_MM, Files
from kendama_cli.plugins.publication.latex import escaped, latex_document
from kendama_cli.plugins.publication.report_export import Facts, methods_text
from kendama_cli.report.grid import Cell, percent, with_interval
from kendama_cli.report.page import make_report
from kendama_cli.report.plot import drawing
from kendama_cli.report.receiver import made_for
from kendama_cli.report.source import StageLog
from kendama_cli.report.sweep_page import make_sweep_report
from kendama_cli.schema.declaration import find_stage, stage_names
from tests.report.synthetic_sweep import write_explorations, write_transfers

FIGURE = ("csv", "pdf", "png", "svg", "tex", "txt")


@pytest.fixture(scope="module", name="some")
def some_stages(run, logs):
    """A run of two stages: all of them would take a minute."""
    names = ("encode", "learn")
    return {**run, "stages": [one for one in run["stages"] if one["name"] in names]}, {
        name: logs[name] for name in names
    }


@pytest.fixture(scope="module", name="files")
def files_of_some(some) -> Files:
    files = Files("run 7 of swingup, kendama 0", "7", None)
    with made_for(files):
        make_report(*some)
    return files


@pytest.fixture(scope="module")
def made(files) -> dict[str, bytes]:
    return files.made


def rows_of(content: bytes) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(content.decode())))


def test_every_plot_of_the_page_is_there_in_every_form(some, made):
    plots = make_report(*some).count('<svg class="plot"')
    names = {name.partition(".")[0] for name in made}
    assert len(names) == plots > 5
    assert set(made) == {f"{name}.{suffix}" for name in names for suffix in FIGURE}


def two_lines(width_mm: float | None = None) -> dict[str, bytes]:
    """A figure of two series, in every form but those of its caption."""
    files = Files("sweep a, 8 runs", "a", width_mm)
    with made_for(files), drawing("two", "") as made:
        axes = made.axes()[0]
        axes.plot([1, 2], label="one")
        axes.plot([2, 1], label="other")
    return files.made


def test_the_same_figure_gives_the_same_bytes():
    made = two_lines()
    assert {name.partition(".")[2] for name in made} == set(FIGURE) - {"tex", "txt"}
    assert two_lines() == made


def test_each_figure_alone_tells_its_run_and_names_every_series(made):
    """PDF text is outside text of glyphs; the SVG's outlines and the PNG come from the same canvas."""
    for name, content in made.items():
        if name.endswith(".csv"):
            rows = rows_of(content)
            assert {row["run"] for row in rows} == {"7"}
            assert [row for row in rows if not row["series"] or not row["y_label"]] == [], name
        if name.endswith(".txt"):
            caption, source = content.decode().splitlines()
            assert source == "run 7 of swingup, kendama 0"
            assert len(caption.split()) >= 8
            assert "(a)" not in caption


def test_a_figure_with_several_series_has_a_legend_and_the_run_in_its_margin():
    seen = []

    class Looking(Files):
        def figure(self, name, canvas):
            seen.append((canvas.axes[0].get_legend(), canvas.get_supxlabel()))

    with made_for(Looking("sweep a, 8 runs", "a")), drawing("two", "") as made:
        axes = made.axes()[0]
        axes.plot([1, 2], label="one")
        axes.plot([2, 1], label="other")
    ((legend, line),) = seen
    assert [text.get_text() for text in legend.get_texts()] == ["one", "other"]
    assert line == "sweep a, 8 runs"


def test_the_data_behind_the_reward_is_that_of_the_log(logs, made):
    rewards = StageLog(logs["learn"]).table("/learn/rollout", RolloutMessage).reward
    rows = rows_of(made["learn-reward.csv"])
    drawn = [float(row["y"]) for row in rows if row["series"].startswith(("explored", "greedy"))]
    assert {row["y_label"] for row in rows} == {"reward"}
    assert sorted(drawn) == sorted(rewards)


def width_mm(svg: bytes) -> float:
    return float(ElementTree.fromstring(svg).get("width", "").removesuffix("pt")) / 72 * 25.4


def test_figures_fit_a_column_and_carry_their_fonts(made):
    for name, content in made.items():
        if name.endswith(".svg"):
            assert round(width_mm(content), 1) in (COLUMN_MM, PAGE_MM)
            assert b"<text" not in content, "letters are outlines"
        if name.endswith(".pdf"):
            assert b"/FontFile2" in content
            assert b"/Type3" not in content
            assert b"CreationDate" not in content


def test_figures_have_the_width_that_is_asked_for():
    assert width_mm(two_lines(120.0)["two.svg"]) == pytest.approx(120.0, abs=0.05)


def test_a_table_is_exact_as_csv_and_readable_as_latex():
    files = Files("run 7", "7")
    metrics = {"frozen_rate": 0.98765432, "position_error_mm_p50": -1.5, "learned": True, "n_runs": None}
    files.metrics("learn", metrics, "3")
    rows = list(csv.reader(io.StringIO(files.made["learn-metrics.csv"].decode())))
    assert rows[0] == ["run", "seed", "metric", "unit", "value"]
    assert rows[1] == ["7", "3", "frozen rate", "", "0.98765432"]
    assert rows[2] == ["7", "3", "position error, median", "mm", "-1.5"]
    text = files.made["learn-metrics.tex"].decode()
    assert r"3 & frozen rate &  & 0.9877 \\" in text
    assert r"3 & position error, median & mm & $-$1.5 \\" in text


def test_a_table_of_the_page_has_a_column_for_each_setting_and_bound():
    files = Files("sweep a", "a")
    group = Cell("0.3", settings={"learn.alpha": "0.3", "seeds": "1 2"})
    rows = [
        [group, with_interval(12.3456, (10.0, 14.0)), percent(0.5, between=(0.25, 0.75))],
        [Cell("mean"), Cell("–"), percent(0.5)],
    ]
    files.grid("t", "Title & more", ["learn.alpha", "rollouts", "caught"], rows)
    found = rows_of(files.made["t.csv"])
    assert found[0] == {
        "run": "a", "learn.alpha": "0.3", "seeds": "1 2", "rollouts": "12.3456", "rollouts, low": "10.0",
        "rollouts, high": "14.0", "caught": "0.5", "caught, low": "0.25", "caught, high": "0.75",
    }  # fmt: skip
    assert found[1]["learn.alpha"] == "mean"
    text = files.made["t.tex"].decode()
    assert r"0.3 & 12.3 (10 \ldots{} 14) & 50 \% (25 \ldots{} 75) \\" in text
    assert r"\caption{Title \& more}" in text


def test_bars_and_images_tell_their_values():
    files = Files("run 7", "7")
    with made_for(files), drawing("both", "") as made:
        upper, lower = made.axes(2)
        upper.bar([1.0, 2.0], [3.0, 4.0])
        lower.imshow([[1.0, 2.0], [3.0, 4.0]], origin="lower", extent=(0, 2, 0, 2))
    rows = list(csv.reader(io.StringIO(files.made["both.csv"].decode())))[1:]
    assert [(float(row[5]), float(row[6])) for row in rows if row[4] == "bars"] == [(1.0, 3.0), (2.0, 4.0)]
    assert [tuple(map(float, row[5:])) for row in rows if row[4] == "image"] == [
        (0.5, 0.5, 1.0),
        (1.5, 0.5, 2.0),
        (0.5, 1.5, 3.0),
        (1.5, 1.5, 4.0),
    ]


def test_signs_that_latex_lacks_are_told_in_ascii():
    text = escaped("λ 0.5 % – a_b² ü ’x’ €")
    assert text.isascii()
    assert text == r"$\lambda$ 0.5 \% -- a\_b$^2$ u 'x' ?"


@pytest.mark.parametrize("write", [write_explorations, write_transfers])
def test_every_figure_of_a_sweep_names_groups_and_runs(write, tmp_path):
    files = Files("sweep a, 9 runs", "sweep a, 9 runs")
    with made_for(files):
        make_sweep_report("", write(tmp_path))
    figures = [name for name in files.made if name.endswith(".pdf")]
    assert figures
    for name in figures:
        rows = rows_of(files.made[name.replace(".pdf", ".csv")])
        assert [row for row in rows if not row["series"]] == [], name
    tables = [
        rows_of(files.made[name])
        for name in files.made
        if name.endswith(".csv") and name[:-3] + "pdf" not in files.made
    ]
    assert tables
    for rows in tables:
        assert {"run", "seeds"} < set(rows[0])


def test_methods_are_told_from_declarations_and_leave_out_what_a_run_lacks():
    record = {"run": "7", "pipeline": "swingup", "overrides": ["seed=1"], "versions": {"kendama": "0.3.0"}}
    records = [{**record, "stages": [{"name": "learn"}]}, {**record, "run": "8", "stages": []}]
    found = [
        Facts({"learn": {"alpha": alpha, "gamma": 0.9, "trace_decay": 1, "traces": "replacing"}}, {})
        for alpha in (0.3, 0.5)
    ]
    text = methods_text(records, {"learn": found})
    assert "The learning rate was 0.3 and 0.5, the discount 0.9 and the trace decay 1" in text
    assert "{" not in text
    assert "kendama 0.3.0" in text


def test_every_setting_that_a_methods_sentence_names_is_in_the_configuration(tmp_path):
    """A name that nothing has would silently leave its sentence out for ever."""
    configured = composed(find_site(tmp_path), [])
    for name in stage_names():
        declaration = find_stage(name)
        for key in re.findall(r"\{([^}]*)\}", " ".join(declaration.methods if declaration else ())):
            value = configured
            for part in key.split("."):
                if "." in key:
                    assert part in value, f"{name}: {key}"
                    value = value[part]


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex (Debian: texlive-latex-recommended)")
def test_figures_and_tables_compile_with_latex(files, tmp_path):
    table = Files("run 7", "7")
    table.metrics("learn", {"odd_name_%": 1.5, "warnings": "50 % & more: \\\\input{x} ² λ €"}, "1")
    for name, content in (files.made | table.made).items():
        (tmp_path / name).write_bytes(content)
    names = sorted([*files.shown, *table.shown])
    (tmp_path / "all.tex").write_text(latex_document("run 7 & others", names))
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "all.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    assert f"({len(names)} pages" in done.stdout


def test_a_table_for_latex_has_no_command_that_a_value_brings() -> None:
    files = Files("run 7", "7")
    files.metrics("encode", {"x": r"\input{/etc/passwd} ^~"}, "1")
    assert (
        rb"\textbackslash{}input\{/etc/passwd\} \textasciicircum{}\textasciitilde{}" in files.made["encode-metrics.tex"]
    )
