// Charts as SVG in the width of the page: axes in units that suit the numbers, bands for bounds, values under pointer and arrow keys.
"use strict";
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  /** The classes s0, s1 and so on of the style. */
  const COLOURS = 6;
  const PREFIXES = ["a", "f", "p", "n", "\u00b5", "m", "", "k", "M", "G", "T"];
  const element = (name, attributes, text) => {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    return node;
  };
  const known = (x) => typeof x === "number" && Number.isFinite(x);
  const minus = (text) => text.replace("-", "\u2212");

  /** The power of a thousand that the numbers of an axis are divided by, and the unit with its prefix. */
  function scaled(axis, values) {
    const largest = Math.max(0, ...values.map(Math.abs));
    if (!axis.unit || axis.unit === "%" || largest === 0) return { factor: 1, unit: axis.unit };
    const power = Math.min(4, Math.max(-6, Math.floor(Math.log10(largest * (1 + 1e-9)) / 3)));
    return { factor: 1000 ** power, unit: PREFIXES[power + 6] + axis.unit };
  }

  /** Round values from one end to the other, with as many decimals as distinguish them. */
  function ticks(from, to, most) {
    const raw = (to - from) / Math.max(1, most);
    const decade = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].find((s) => s * decade >= raw * (1 - 1e-9)) * decade;
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (Math.abs((step / decade) - 2.5) < 1e-9 ? 1 : 0));
    const found = [];
    for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9 * step; k++) {
      found.push({ at: k * step, text: minus((k * step).toFixed(places).replace(/^-(0(\.0*)?)$/, "$1")) });
    }
    return found;
  }

  /** 1, 2 and 5 in each decade, or powers of ten alone where these would be too many. */
  function logTicks(from, to, most) {
    const multiples = (digits) => {
      const found = [];
      for (let p = Math.floor(Math.log10(from)); p <= Math.log10(to); p++) {
        for (const d of digits) if (d * 10 ** p >= from * (1 - 1e-9) && d * 10 ** p <= to * (1 + 1e-9)) found.push(d * 10 ** p);
      }
      return found;
    };
    const fine = multiples([1, 2, 5]);
    return (fine.length <= most ? fine : multiples([1])).map((at) => ({ at, text: String(Number(at.toPrecision(3))) }));
  }

  /** The ends of a linear axis: it begins at zero where the values come near it. */
  function range(values) {
    const low = Math.min(...values), high = Math.max(...values);
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (high - low <= 1e-9 * size || size === 0) return [low - 0.1 * (size || 1), high + 0.1 * (size || 1)];
    const room = 0.06 * (high - low);
    return [low >= 0 && low < 0.4 * high ? 0 : low - room, high <= 0 && high > 0.4 * low ? 0 : high + room];
  }

  /** The chart as SVG in this width, with the functions that lead from values to places in it; null without values. */
  function draw(chart, width) {
    const xs = chart.series.flatMap((s) => s.x).filter(known);
    const ys = chart.series.flatMap((s) => [...s.y, ...(s.lower ?? []), ...(s.upper ?? [])]).filter(known);
    if (!xs.length || !ys.length) return null;
    const height = Math.round(Math.min(340, Math.max(230, 0.62 * width)));
    const scaleX = scaled(chart.x, xs), scaleY = scaled(chart.y, ys);
    const [y0, y1] = range(ys.map((y) => y / scaleY.factor));
    const inX = xs.map((x) => x / scaleX.factor);
    const [x0, x1] = chart.x.log ? [Math.min(...inX) / 1.15, Math.max(...inX) * 1.15] : range(inX);
    const yTicks = ticks(y0, y1, height / 55);
    const left = 34 + 7.5 * Math.max(...yTicks.map((t) => t.text.length)), right = width - 14, top = 10, bottom = height - 44;
    const mostX = (right - left) / 62;
    const xTicks = chart.x.log ? logTicks(x0, x1, mostX) : ticks(x0, x1, mostX);
    const share = chart.x.log
      ? (x) => Math.log(x / scaleX.factor / x0) / Math.log(x1 / x0)
      : (x) => (x / scaleX.factor - x0) / (x1 - x0);
    const toX = (x) => left + share(x) * (right - left);
    const toY = (y) => bottom - ((y / scaleY.factor - y0) / (y1 - y0)) * (bottom - top);
    const at = (x, y) => `${toX(x).toFixed(1)} ${toY(y).toFixed(1)}`;

    const svg = element("svg", { viewBox: `0 0 ${width} ${height}`, width, height, "aria-hidden": "true" });
    for (const t of xTicks) {
      const x = toX(t.at * scaleX.factor).toFixed(1);
      svg.append(element("path", { d: `M${x} ${top}V${bottom}`, class: "grid" }));
      svg.append(element("text", { x, y: bottom + 17, "text-anchor": "middle" }, t.text));
    }
    for (const t of yTicks) {
      const y = toY(t.at * scaleY.factor);
      svg.append(element("path", { d: `M${left} ${y.toFixed(1)}H${right}`, class: "grid" }));
      svg.append(element("text", { x: left - 7, y: (y + 4).toFixed(1), "text-anchor": "end" }, t.text));
    }
    svg.append(element("path", { d: `M${left} ${top}V${bottom}H${right}`, class: "axis" }));
    const named = (axis, unit) => (unit ? `${axis.label} (${unit})` : axis.label);
    svg.append(element("text", { x: (left + right) / 2, y: height - 7, "text-anchor": "middle", class: "label" }, named(chart.x, scaleX.unit)));
    const middle = (top + bottom) / 2;
    svg.append(element("text", { transform: `translate(13 ${middle}) rotate(-90)`, "text-anchor": "middle", class: "label" }, named(chart.y, scaleY.unit)));

    chart.series.forEach((s, k) => {
      const drawn = s.x.map((_, i) => i).filter((i) => known(s.x[i]) && known(s.y[i]));
      const group = element("g", { class: `s${k % COLOURS} ${s.style}` });
      const banded = drawn.filter((i) => known(s.lower?.[i]) && known(s.upper?.[i]));
      if (banded.length > 1 && s.style === "line") {
        const upper = banded.map((i) => at(s.x[i], s.upper[i])), lower = banded.map((i) => at(s.x[i], s.lower[i])).reverse();
        group.append(element("path", { d: `M${[...upper, ...lower].join("L")}Z`, class: "band" }));
      }
      if (s.style !== "points" && drawn.length > 1) group.append(element("path", { d: `M${drawn.map((i) => at(s.x[i], s.y[i])).join("L")}`, class: "line" }));
      for (const i of drawn) {
        if (s.style === "points" && known(s.lower?.[i])) group.append(element("path", { d: `M${at(s.x[i], s.lower[i])}L${at(s.x[i], s.upper[i])}`, class: "line" }));
        if (s.style !== "dashed" && drawn.length < 120) group.append(element("circle", { cx: toX(s.x[i]).toFixed(1), cy: toY(s.y[i]).toFixed(1), r: 3.4 }));
      }
      svg.append(group);
    });
    const cursor = element("g", { class: "cursor", visibility: "hidden" });
    svg.append(cursor);
    return { svg, cursor, toX, toY, left, right, top, bottom, scaleX, scaleY };
  }

  /** A number of an axis, to five digits. */
  function shown(value, scale) {
    const text = minus(String(Number((value / scale.factor).toPrecision(5))));
    return scale.unit ? `${text}\u00a0${scale.unit}` : text;
  }

  /** Puts a chart with its legend into an element of the page, and shows values under the pointer and by the arrow keys. */
  function set(place, chart) {
    const keys = document.createElement("ul");
    keys.className = "keys";
    chart.series.forEach((s, k) => {
      const item = document.createElement("li");
      item.className = `s${k % COLOURS} ${s.style}`;
      item.append(document.createElement("i"), s.name);
      keys.append(item);
    });
    const canvas = document.createElement("div");
    canvas.className = "canvas";
    const tip = document.createElement("div");
    tip.className = "tip";
    tip.setAttribute("role", "status");
    place.append(keys, canvas, tip);

    // Points of different series at the same x are shown together; several points of one series at the same x, one after the other.
    const groups = new Map();
    chart.series.forEach((s, k) => {
      const seen = new Map();
      s.x.forEach((x, i) => {
        if (!known(x) || !known(s.y[i])) return;
        const count = (seen.get(x) ?? -1) + 1, key = `${x} ${count}`;
        seen.set(x, count);
        if (!groups.has(key)) groups.set(key, { x, count, at: [] });
        groups.get(key).at.push([s, k, i]);
      });
    });
    const points = [...groups.values()].sort((a, b) => a.x - b.x || a.count - b.count);
    let drawn = null, current = -1;
    function redraw(width) {
      drawn = draw(chart, width);
      canvas.replaceChildren(...(drawn ? [drawn.svg] : ["No values."]));
      if (current >= 0) show(current);
    }
    function show(index) {
      current = index;
      if (!drawn || index < 0) return hide();
      const { x, at } = points[index], { cursor, toX, toY, top, bottom, scaleX, scaleY } = drawn;
      cursor.replaceChildren(element("path", { d: `M${toX(x).toFixed(1)} ${top}V${bottom}` }));
      const lines = [`${chart.x.label} ${shown(x, scaleX)}`];
      for (const [s, k, i] of at) {
        cursor.append(element("circle", { cx: toX(x), cy: toY(s.y[i]), r: 6, class: `s${k % COLOURS}` }));
        const bounds = known(s.lower?.[i]) ? ` (${shown(s.lower[i], scaleY)} to ${shown(s.upper[i], scaleY)})` : "";
        lines.push(`${s.name.split(/, (?:with|and) /)[0]}: ${shown(s.y[i], scaleY)}${bounds}`);
      }
      cursor.setAttribute("visibility", "visible");
      tip.replaceChildren(...lines.map((line) => Object.assign(document.createElement("div"), { textContent: line })));
      tip.style.display = "block";
      // Beside the point and off the line: below a point in the upper half, above one in the lower half.
      const y = toY(at[0][0].y[at[0][2]]), down = canvas.offsetTop;
      tip.style.top = `${y < (top + bottom) / 2 ? down + y + 14 : Math.max(0, down + y - 14 - tip.offsetHeight)}px`;
      const right = toX(x) > place.clientWidth / 2;
      tip.style.left = right ? "auto" : `${toX(x) + 12}px`;
      tip.style.right = right ? `${place.clientWidth - toX(x) + 12}px` : "auto";
    }
    function hide() {
      current = -1;
      tip.style.display = "none";
      drawn?.cursor.setAttribute("visibility", "hidden");
    }
    canvas.addEventListener("pointermove", (event) => {
      if (!drawn || !points.length) return;
      const box = drawn.svg.getBoundingClientRect();
      const scale = drawn.svg.viewBox.baseVal.width / box.width;
      const x = (event.clientX - box.left) * scale, y = (event.clientY - box.top) * scale;
      // The nearest point along x; of several at the same x, the nearest along y.
      const apart = (p) => 1000 * Math.abs(drawn.toX(p.x) - x) + Math.min(...p.at.map(([s, , i]) => Math.abs(drawn.toY(s.y[i]) - y)));
      show(points.reduce((best, p, i) => (apart(p) < apart(points[best]) ? i : best), 0));
    });
    canvas.addEventListener("pointerleave", hide);
    place.addEventListener("blur", hide);
    place.addEventListener("keydown", (event) => {
      const last = points.length - 1;
      const to = { ArrowRight: Math.min(last, current + 1), ArrowLeft: current < 0 ? last : Math.max(0, current - 1), Home: 0, End: last }[event.key];
      if (event.key === "Escape") hide();
      else if (to !== undefined && last >= 0) {
        event.preventDefault();
        show(to);
      }
    });
    let width = 0;
    new ResizeObserver(() => {
      if (Math.round(canvas.clientWidth) !== width && canvas.clientWidth > 0) redraw((width = Math.round(canvas.clientWidth)));
    }).observe(canvas);
  }

  for (const chart of elastocap.data.charts ?? []) {
    const place = document.getElementById(chart.id);
    if (place) set(place, chart);
  }
})();
