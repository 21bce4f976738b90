"""Runs every case of cases/, draws what a run writes, and puts the pictures and their page into docs.

    pip install cairosvg pillow
    npm install --no-save --prefix /tmp/pictures three @sparticuz/chromium puppeteer-core
    cargo build --release
    NODE_PATH=/tmp/pictures/node_modules python benches/pictures/make.py

scene.glb is drawn by three.js in a browser without a window (render.mjs), curve.svg and section_NNN.svg by cairo. All files are
those of a run; nothing is drawn that is not in them.
"""

import io
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import cairosvg
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "pictures"
WIDTH = 560  # of each picture of a row

HEAD = """# Pictures

This page shows what a run of each shipped case looks like: `scene.glb` at the first and the last load step, the sections `section_NNN.svg` through the gap,
and `curve.svg`. `benches/pictures/make.py` runs the cases and makes this page.

In the scenes the layer is light blue, the substrate sand-coloured, floating conductors are green and the indenter grey. In the sections, metal is dark grey,
bands and lines are those of equal potential, and arrows point along the field; longer ones are stronger, but not in proportion.
"""


def from_svg(path):
    return Image.open(io.BytesIO(cairosvg.svg2png(url=str(path), output_width=2 * WIDTH)))


def row(images):
    """Pictures beside each other, each `WIDTH` wide."""
    scaled = [image.convert("RGB").resize((WIDTH, round(image.height * WIDTH / image.width))) for image in images]
    out = Image.new("RGB", (WIDTH * len(scaled), max(image.height for image in scaled)), "white")
    for k, image in enumerate(scaled):
        out.paste(image, (k * WIDTH, 0))
    return out


def on_top_of_each_other(rows):
    out = Image.new("RGB", (max(r.width for r in rows), sum(r.height for r in rows)), "white")
    y = 0
    for r in rows:
        out.paste(r, (0, y))
        y += r.height
    return out


def main():
    program = ROOT / "target" / "release" / "elastocap"
    cases = sorted((ROOT / "cases").glob("*.toml"))
    PICTURES.mkdir(exist_ok=True)
    text = [HEAD]
    with tempfile.TemporaryDirectory() as place:
        results = Path(place)
        for case in cases:
            run = subprocess.run([program, "run", case, "-q", "-o", results / case.stem], stderr=subprocess.DEVNULL)
            if run.returncode not in (0, 3):
                sys.exit(f"{case.name}: exit status {run.returncode}")
        scenes = [f"{results / case.stem / 'scene.glb'}={case.stem}" for case in cases]
        subprocess.run(["node", ROOT / "benches" / "pictures" / "render.mjs", results, *scenes], check=True)
        for case in cases:
            shown = [results / f"{case.stem}-{end}.png" for end in ("first", "last")]
            scenes = [Image.open(path) for path in shown if path.is_file()]
            sections = [from_svg(path) for path in sorted((results / case.stem).glob("section_*.svg"))]
            curves = [from_svg(path) for path in [results / case.stem / "curve.svg"] if path.is_file()]
            if len(scenes) == 1:
                rows = [row(scenes + sections + curves)]
            else:
                rows = [row(scenes)] + ([row(sections)] if sections else []) + [row(curves)]
            # A palette would lose the colours of small bodies.
            picture = on_top_of_each_other(rows)
            picture.save(PICTURES / f"{case.stem}.png", optimize=True)
            title = re.search(r'^title\s*=\s*"(.*)"', case.read_text(), re.MULTILINE).group(1)
            text.append(f"## {title}\n\n[{case.stem}](../cases/{case.name})\n\n![{case.stem}](pictures/{case.stem}.png)\n")
    (ROOT / "docs" / "pictures.md").write_text("\n".join(text))
    total = sum(path.stat().st_size for path in PICTURES.iterdir())
    print(f"{len(cases)} cases, {total / 1e6:.2f} MB")
    stale = {path.stem for path in PICTURES.glob("*.png")} - {case.stem for case in cases}
    if stale:
        sys.exit(f"pictures without a case: {sorted(stale)}")


if __name__ == "__main__":
    main()
