"""The look of the page: one palette for figures and text, light and dark, and the style sheet."""

from __future__ import annotations

INK = "#1b1b1f"
MUTED = "#6a6a72"
LINE = "#d9d9de"
PAPER = "#fffffe"
CUP = "#0072b2"
BALL = "#d55e00"
GOOD = "#009e73"
EXPLORED = "#e69f00"
OTHER = "#8a5fa8"
SKY = "#56b4e9"
ROSE = "#cc79a7"
EARTH = "#7f5539"

SERIES = (CUP, BALL, GOOD, OTHER, EXPLORED, SKY, ROSE, MUTED, EARTH)
"""Groups or joints that stand side by side, in this order: nine that differ, as an arm on a rail has."""

VARIABLES = {
    INK: "--ink",
    MUTED: "--muted",
    LINE: "--line",
    PAPER: "--paper",
    CUP: "--cup",
    BALL: "--ball",
    GOOD: "--good",
    EXPLORED: "--explored",
    OTHER: "--other",
}
"""Figure colour -> CSS variable. Cup, ball, good and explored are Okabe and Ito's colour-blind-safe hues."""

_DARK = {
    INK: "#e8e8ea",
    MUTED: "#a3a3ab",
    LINE: "#3a3b42",
    PAPER: "#16171b",
    CUP: "#5db4ee",
    BALL: "#f28443",
    GOOD: "#33c49a",
    EXPLORED: "#f0b840",
    OTHER: "#bd97d8",
}


def _variables(colours: dict[str, str]) -> str:
    return "".join(f"{name}:{colours[colour]};" for colour, name in VARIABLES.items())


CSS = (
    ":root{color-scheme:light dark;"
    + _variables({colour: colour for colour in VARIABLES})
    + "--tint:#f5f5f2;--serif:Charter,'Bitstream Charter','Iowan Old Style','Source Serif 4',Georgia,serif;"
    "--sans:'Helvetica Neue',Helvetica,Arial,'Liberation Sans','DejaVu Sans',sans-serif;"
    "--mono:ui-monospace,'SF Mono',Menlo,Consolas,'DejaVu Sans Mono',monospace}"
    "@media screen and (prefers-color-scheme:dark){:root{"
    + _variables(_DARK)
    + """--tint:#1f2026}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%;scroll-behavior:smooth}
body{margin:0;background:var(--paper);color:var(--ink);font:17px/1.55 var(--serif)}
main{max-width:1080px;margin:0 auto;padding:56px 28px 80px}
h1{font-size:38px;line-height:1.12;font-weight:600;letter-spacing:-.012em;margin:0 0 12px;max-width:22em;
 text-wrap:balance}
h2{font-size:25px;line-height:1.25;font-weight:600;letter-spacing:-.006em;margin:0}
p{margin:0 0 14px;max-width:44em}
a{color:inherit;text-decoration-color:var(--muted);text-underline-offset:3px}
code{font:.84em var(--mono);overflow-wrap:anywhere}
.lead{font-size:18.5px;color:var(--ink)}
.run{font:13px/1.5 var(--sans);color:var(--muted);margin:0 0 28px}
.contents{display:flex;flex-wrap:wrap;gap:6px 22px;margin:0 0 34px;padding:12px 0;list-style:none;
 border:solid var(--line);border-width:1px 0;font:14px/1.5 var(--sans)}
.contents a{text-decoration:none}.contents a:hover{text-decoration:underline}
.contents .off a{color:var(--muted)}
.hero{display:grid;grid-template-columns:minmax(0,3fr) minmax(0,2fr);gap:36px;align-items:center;margin:0 0 20px}
.results{margin:0;display:grid;grid-template-columns:repeat(auto-fill,minmax(150px,1fr));gap:22px 24px;
 font-family:var(--sans)}
.results div{border-top:2px solid var(--ink);padding-top:8px;display:flex;flex-direction:column-reverse;
 justify-content:flex-end}
.results dt{font-size:12.5px;line-height:1.35;color:var(--muted)}
.results dd{margin:0 0 2px;font-size:27px;line-height:1.2;font-weight:500;font-variant-numeric:tabular-nums;
 letter-spacing:-.01em}
.results dd small{font-size:14px;color:var(--muted);font-weight:400;margin-left:3px}
section{margin:64px 0 0;padding-top:22px;border-top:1px solid var(--line)}
section>header{display:flex;align-items:baseline;gap:14px;margin:0 0 10px}
section>header .what{font:13px var(--sans);color:var(--muted)}
.notice{font:15px/1.5 var(--sans);background:var(--tint);border-left:3px solid var(--ball);padding:12px 16px;
 margin:14px 0;max-width:none;overflow-wrap:anywhere}
figure{margin:26px 0 30px}
.panels{display:grid;gap:22px 28px;align-items:start}
.cols-2{grid-template-columns:repeat(2,minmax(0,1fr))}.cols-3{grid-template-columns:repeat(3,minmax(0,1fr))}
.panel{min-width:0;overflow-x:auto}
.panel h3{font:600 13px/1.4 var(--sans);margin:0 0 4px}
.panel h3 b{margin-right:7px}
svg{display:block;width:100%;height:auto}
svg text{font-family:var(--sans)!important}
figcaption{font:14px/1.5 var(--sans);color:var(--ink);margin-top:12px;max-width:62em}
figcaption b:first-child{margin-right:4px}
.save{font:12.5px var(--sans);color:var(--muted);background:none;border:0;padding:6px 0;cursor:pointer;
 text-decoration:underline;text-underline-offset:3px}
.save:hover{color:var(--ink)}
.thumbs{display:grid;grid-template-columns:repeat(4,minmax(0,1fr));gap:8px}
.thumbs div{min-width:0}.thumbs p{font:12px/1.4 var(--sans);color:var(--muted);margin:4px 0 0}
.facts{display:grid;grid-template-columns:repeat(auto-fill,minmax(235px,1fr));gap:0 28px;margin:18px 0 0;
 font:14px/1.4 var(--sans)}
.facts div{display:flex;justify-content:space-between;gap:14px;border-bottom:1px solid var(--line);padding:6px 0}
.facts dt{color:var(--muted);overflow-wrap:anywhere}
.facts dd{margin:0;font-variant-numeric:tabular-nums;text-align:right}
details{margin:16px 0 0;font:14px/1.5 var(--sans)}
summary{cursor:pointer;color:var(--muted)}
.settings{columns:3 260px;column-gap:28px;margin:10px 0 0;font:12.5px/1.5 var(--mono)}
.settings div{break-inside:avoid;display:flex;justify-content:space-between;gap:12px;
 border-bottom:1px solid var(--line);padding:3px 0}
.settings dt{color:var(--muted);overflow-wrap:anywhere}.settings dd{margin:0;text-align:right;overflow-wrap:anywhere}
.wide{overflow-x:auto;margin:10px 0 6px}
.grid{border-collapse:collapse;width:100%;font:14px/1.35 var(--sans);font-variant-numeric:tabular-nums}
.grid th,.grid td{padding:7px 14px 7px 0;text-align:right;vertical-align:top;border-bottom:1px solid var(--line)}
.grid th:first-child{text-align:left}.grid tr>:last-child{padding-right:0}
.grid thead th{font-weight:500;color:var(--muted);font-size:12.5px;vertical-align:bottom;
 border-bottom:1px solid var(--ink)}
.grid tbody th,.grid tfoot th{font-weight:500;white-space:nowrap}
.grid tfoot th,.grid tfoot td{border-bottom:0;border-top:1px solid var(--ink);font-weight:600}
.grid small{display:block;font-size:12px;font-weight:400;color:var(--muted);white-space:nowrap}
section>h3{font:600 15px/1.4 var(--sans);margin:26px 0 0}
.note{font:14px/1.5 var(--sans);color:var(--muted);max-width:62em;margin:8px 0 0}
.replay{margin:0 0 30px}
.replay .stage{position:relative;aspect-ratio:16/9;border:1px solid var(--line);border-radius:6px;overflow:hidden;
 background:var(--tint)}
.replay canvas{position:absolute;inset:0;width:100%;height:100%;display:block;outline-offset:-3px;cursor:grab}
.replay canvas:active{cursor:grabbing}
.replay .legend{position:absolute;inset:0;display:flex;max-width:none;margin:0;pointer-events:none;
 font:600 12.5px/1.4 var(--sans);color:var(--muted)}
.replay .legend.tall{flex-direction:column}
.replay .legend span{flex:1;padding:10px 14px}
.replay .legend span+span{border-left:1px solid var(--line)}
.replay .legend.tall span+span{border-left:0;border-top:1px solid var(--line)}
.replay .cameras{display:flex;gap:8px;margin:12px 0 0}.replay .cameras[hidden]{display:none}
.replay .cameras figure{flex:0 1 420px;min-width:0;margin:0}
.replay .cameras svg{display:block;width:100%;height:auto;border-radius:4px;background:var(--tint)}
.replay .cameras figcaption{font:12px/1.4 var(--sans);color:var(--muted);margin:4px 0 0}
.replay .cameras circle{fill:none;stroke:#00e5ff;stroke-width:2px;vector-effect:non-scaling-stroke}
.replay .choose{flex-wrap:wrap;gap:8px 16px}
.replay .choose label{display:flex;align-items:center;gap:6px;cursor:pointer}
.replay .choose input{flex:none;min-width:0;margin:0}
.replay .keys{margin:8px 0 0;max-width:none}
.replay .controls output{min-width:62px}
.seg{display:inline-flex}
.controls .seg button{border-radius:0;margin-left:-1px;min-width:38px}
.controls .seg button:first-child{border-radius:4px 0 0 4px;margin-left:0}
.controls .seg button:last-child{border-radius:0 4px 4px 0}
.controls button[aria-pressed=true]{background:var(--ink);border-color:var(--ink);color:var(--paper)}
.controls button:disabled{opacity:.45;cursor:default}
@media screen{.in-space .hero{grid-template-columns:minmax(0,1fr)}.in-space .flat{display:none}
 .in-space .results{grid-template-columns:repeat(auto-fit,minmax(150px,1fr))}}
.player{margin:0}
.controls{display:flex;align-items:center;gap:10px;font:13px var(--sans);color:var(--muted);margin-top:6px}
.controls button{font:inherit;color:var(--ink);background:none;border:1px solid var(--line);border-radius:4px;
 padding:5px 10px;cursor:pointer;min-width:62px}
.controls button:hover{border-color:var(--muted)}
.controls input{flex:1;min-width:60px;accent-color:var(--cup)}
.controls output{font-variant-numeric:tabular-nums;min-width:52px;text-align:right}
footer{margin-top:72px;padding-top:16px;border-top:1px solid var(--line);font:13px/1.5 var(--sans);color:var(--muted)}
@media(max-width:760px){body{font-size:16.5px}main{padding:30px 16px 60px}h1{font-size:30px}
 .hero,.cols-2,.cols-3{grid-template-columns:minmax(0,1fr)}.hero{gap:20px}
 .thumbs{grid-template-columns:repeat(2,minmax(0,1fr))}section{margin-top:48px}
 .replay .stage{aspect-ratio:4/5}.replay .keys{display:none}
 .cols-3 svg.plot,.cols-2 svg.plot{max-width:520px}.cols-1 svg.plot{min-width:600px}}
@media print{.replay,.save{display:none}
 body{font-size:10.5pt}main{max-width:none;padding:0}.controls{display:none}section{margin-top:28pt}
 figure,.facts,.panel{break-inside:avoid}h2{break-after:avoid}.contents{display:none}}
"""
)
