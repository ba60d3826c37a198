// Draws the plots of a report with uPlot from the JSON in the page.
(function () {
  "use strict";

  const root = document.documentElement;
  const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [14, 5], [5, 2]];
  // Marks, of radius 1, for x-y plots: dashes of a loop driven many times fill each other's gaps.
  const MARKS = [
    "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0 -2 0", "M-1 -1h2v2h-2z", "M0 -1.2l1.2 2.2h-2.4z",
    "M0 -1.4l1.4 1.4l-1.4 1.4l-1.4 -1.4z", "M-1 -1l2 2M-1 1l2 -2", "M-1.3 0h2.6M0 -1.3v2.6",
  ];
  const COLOURS = 6;
  // Wide enough for "-250e-6"; the same in all plots so that their time axes line up.
  const Y_AXIS = 64;
  const PRINT_WIDTH = 660;

  const plots = [];
  // Plots over the same x and the same span of it share the cursor and the zoom.
  const groups = new Map();
  const groupKey = spec => [spec.x, ...extremes([spec.data[0]])].join("|");

  // An error is shown in the page: an empty plot without a word would look like missing data.
  function fail(where, error) {
    const text = "The plot cannot be drawn: " + (error && error.message || error);
    root.dataset.error = text;
    const box = document.createElement("p");
    box.className = "error";
    box.textContent = text;
    (where || document.querySelector("main")).append(box);
  }
  window.addEventListener("error", e => fail(null, e.error || e.message));

  const colour = name => getComputedStyle(root).getPropertyValue(name).trim();
  const lineColour = i => "--l" + i % COLOURS;
  // The dash turns on when the colours come round again, so that all pairs differ.
  const dashOf = i => DASHES[(i + Math.floor(i / COLOURS)) % DASHES.length];

  const markOf = i => MARKS[(i + Math.floor(i / COLOURS)) % MARKS.length];

  const short = v => v == null ? "–" : String(Number(v.toPrecision(6)));

  // Tick texts: all of an axis share the decimals and, if very small or large, one power of ten.
  function tickTexts(u, ticks, axis, space, step) {
    const top = Math.max(...ticks.map(Math.abs));
    if (!(top > 0)) return ticks.map(String);
    let power = 0;
    if (top < 0.01 || top >= 1e5) power = 3 * Math.floor(Math.log10(top * 1.0000001) / 3);
    const unit = Number("1e" + power);
    let decimals = 0;
    while (decimals < 9 && Math.abs(step / unit - Number((step / unit).toFixed(decimals))) > step / unit * 1e-6) decimals++;
    return ticks.map(v => Math.abs(v) < step * 1e-6 ? "0" : (v / unit).toFixed(decimals) + (power ? "e" + power : ""));
  }

  function axis(label, size, more) {
    return Object.assign({
      label: label, labelSize: 22, labelGap: 2, size: size, gap: 5,
      font: "12px system-ui, sans-serif", labelFont: "600 12px system-ui, sans-serif",
      stroke: () => colour("--soft"),
      grid: { stroke: () => colour("--grid"), width: 1 },
      ticks: { stroke: () => colour("--line"), width: 1, size: 5 },
      border: { show: true, stroke: () => colour("--line"), width: 1 },
      values: tickTexts,
    }, more);
  }

  // A range with some room; a single value gets room on both sides.
  function padded(min, max, part) {
    if (min == null || max == null || !isFinite(min) || !isFinite(max)) return [0, 1];
    if (min === max) {
      const d = Math.abs(min) * 0.1 || 1;
      return [min - d, max + d];
    }
    const d = (max - min) * part;
    return [min - d, max + d];
  }

  function extremes(arrays) {
    let min = Infinity, max = -Infinity;
    for (const a of arrays) for (const v of a) {
      if (v === null) continue;
      if (v < min) min = v;
      if (v > max) max = v;
    }
    return min > max ? [null, null] : [min, max];
  }

  // Joins the points in their order (uPlot's own paths need an ascending x) and marks some of
  // them; points that are not to be joined are all marked.
  function curvePath(join) {
    return (u, i) => {
      const [xs, ys] = u.data[i];
      const { left, top, width, height } = u.bbox;
      const sx = u.scales.x, sy = u.scales.y;
      const kx = width / (sx.max - sx.min), ky = height / (sy.max - sy.min);
      const path = new Path2D(), mark = new Path2D(markOf(i - 1));
      const size = 3.5 * uPlot.pxRatio;
      // Curves that run together get their marks at different places.
      const every = join ? Math.ceil(xs.length / 12) : 1, first = Math.floor(every * ((i * 0.37) % 1));
      const marks = new Path2D();
      let pen = false;
      for (let j = 0; j < xs.length; j++) {
        if (xs[j] === null || ys[j] === null) { pen = false; continue; }
        const px = left + (xs[j] - sx.min) * kx, py = top + (sy.max - ys[j]) * ky;
        if (j % every === first) marks.addPath(mark, new DOMMatrix([size, 0, 0, size, px, py]));
        if (join && pen) path.lineTo(px, py);
        else if (join) path.moveTo(px, py);
        pen = true;
      }
      path.addPath(marks);
      return { stroke: path, fill: null, clip: null, band: null, gaps: null, flags: 1 };
    };
  }

  // The point of a curve nearest to the pointer, in pixels; null if it is far away.
  function nearest(u, i) {
    if (i === 0 || u.cursor.left < 0) return null;
    const [xs, ys] = u.data[i];
    const { left, top } = u.cursor;
    let best = 40 * 40, found = null;
    const sx = u.scales.x, sy = u.scales.y;
    const kx = u.over.clientWidth / (sx.max - sx.min), ky = u.over.clientHeight / (sy.max - sy.min);
    for (let j = 0; j < xs.length; j++) {
      if (xs[j] === null || ys[j] === null) continue;
      const dx = (xs[j] - sx.min) * kx - left, dy = (sy.max - ys[j]) * ky - top;
      const d = dx * dx + dy * dy;
      if (d < best) { best = d; found = j; }
    }
    return found;
  }

  function setScales(p, x, y) {
    p.u.batch(() => {
      p.u.setScale("x", { min: x[0], max: x[1] });
      if (y) p.u.setScale("y", { min: y[0], max: y[1] });
    });
  }

  // Shows the ranges; y only counts in an x-y plot, a time plot fits y to what is in view.
  function zoom(p, x, y) {
    if (!(x[1] > x[0]) || y && !(y[1] > y[0])) return;
    if (p.group) for (const q of p.group.plots) setScales(q, x);
    else setScales(p, x, y);
  }

  function reset(p) {
    if (p.group) return zoom(p, p.group.full);
    const shown = p.u.data.filter((d, i) => i > 0 && p.u.series[i].show);
    zoom(p, padded(...extremes(shown.map(d => d[0])), 0.04), padded(...extremes(shown.map(d => d[1])), 0.06));
  }

  // Zooms by `factor` about a place given as parts (0 to 1) of the plot's width and height.
  function zoomAt(p, factor, fx, fy) {
    const about = (s, f) => {
      const c = s.min + (s.max - s.min) * f;
      return [c - (c - s.min) * factor, c + (s.max - c) * factor];
    };
    let x = about(p.u.scales.x, fx);
    if (p.group) {
      const full = p.group.full;
      x = [Math.max(x[0], full[0]), Math.min(x[1], full[1])];
    }
    zoom(p, x, about(p.u.scales.y, fy));
  }

  function onSelect(p) {
    const u = p.u, s = u.select;
    if (s.width < 3 && s.height < 3) return;
    const x = s.width >= 3 ? [u.posToVal(s.left, "x"), u.posToVal(s.left + s.width, "x")] : [u.scales.x.min, u.scales.x.max];
    const y = s.height >= 3 ? [u.posToVal(s.top + s.height, "y"), u.posToVal(s.top, "y")] : [u.scales.y.min, u.scales.y.max];
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    zoom(p, x, p.group ? null : y);
  }

  function options(p, spec) {
    const xy = spec.kind === "xy";
    const series = spec.lines.map((line, i) => ({
      label: line.name,
      stroke: () => colour(lineColour(i)),
      width: 1.5,
      dash: xy ? [] : dashOf(i),
      points: { show: false },
      value: (u, v, s, j) => {
        if (!xy) return short(v);
        return j == null ? "–" : short(u.data[s][0][j]) + ", " + short(u.data[s][1][j]);
      },
    }));
    if (xy) series.forEach((s, i) => {
      s.facets = [{ scale: "x", auto: true, sorted: 0 }, { scale: "y", auto: true, sorted: 0 }];
      s.paths = curvePath(!spec.lines[i].points);
    });
    const cursor = {
      drag: xy ? { x: true, y: true, uni: 20, setScale: false } : { x: true, y: false, setScale: false },
      bind: { dblclick: () => () => { reset(p); return null; } },
      points: { size: 7, width: 1.5, fill: () => colour("--page"), stroke: (u, i) => colour(lineColour(i - 1)) },
    };
    if (xy) cursor.dataIdx = nearest;
    // Only the cursor goes through uPlot; the zoom is shared by zoom() above, so that wheel,
    // buttons and drags are the same.
    else cursor.sync = { key: p.group.key, scales: ["x", null], filters: { pub: t => t === "mousemove" || t === "mouseleave", sub: () => true } };
    const y = (u, min, max) => padded(min, max, 0.06);
    return {
      mode: xy ? 2 : 1,
      width: 600, height: 300, padding: [8, 12, 0, 0],
      cursor: cursor,
      scales: {
        x: xy ? { time: false, range: (u, min, max) => padded(min, max, 0.04) } : { time: false, auto: false, min: p.group.full[0], max: p.group.full[1] },
        y: { range: y },
      },
      axes: [axis(spec.x, 30, { space: 70 }), axis(spec.y, Y_AXIS, { space: 34 })],
      series: [xy ? {} : { label: spec.xName, value: (u, v) => short(v) }].concat(series),
      hooks: { setSelect: [() => onSelect(p)] },
    };
  }

  // The legend shows the line itself, with its dash. Names can be reached by keyboard.
  function dressLegend(p, spec) {
    const rows = p.u.root.querySelectorAll(".u-legend .u-series");
    const first = spec.kind === "xy" ? 0 : 1;
    spec.lines.forEach((line, i) => {
      const row = rows[i + first];
      if (!row) return;
      const marker = row.querySelector(".u-marker");
      marker.removeAttribute("style");
      const style = 'style="stroke:var(' + lineColour(i) + ')" stroke-width="2" fill="none"';
      const xy = spec.kind === "xy";
      let mark = "";
      if (!line.points) mark += '<line x1="0" y1="5" x2="28" y2="5" ' + style + ' stroke-dasharray="' + (xy ? "" : dashOf(i).join(" ")) + '"/>';
      if (xy) mark += '<path transform="translate(14 5) scale(3.5)" vector-effect="non-scaling-stroke" d="' + markOf(i) + '" ' + style + "/>";
      marker.innerHTML = '<svg width="28" height="10" aria-hidden="true">' + mark + "</svg>";
      const name = row.querySelector("th");
      name.tabIndex = 0;
      name.setAttribute("role", "button");
      name.title = "Show or hide " + line.name;
      name.addEventListener("keydown", e => {
        if (e.key !== "Enter" && e.key !== " ") return;
        e.preventDefault();
        name.click();
      });
    });
    // uPlot leaves an empty marker for x.
    if (first) rows[0].querySelector(".u-marker").remove();
  }

  function addButtons(p, figure) {
    const box = document.createElement("div");
    box.className = "buttons";
    const add = (text, title, act) => {
      const b = document.createElement("button");
      b.type = "button";
      b.textContent = text;
      b.title = title;
      b.setAttribute("aria-label", title);
      b.addEventListener("click", act);
      box.append(b);
    };
    add("+", "Zoom in", () => zoomAt(p, 0.5, 0.5, 0.5));
    add("−", "Zoom out", () => zoomAt(p, 2, 0.5, 0.5));
    add("Reset", "Show all", () => reset(p));
    figure.querySelector(".plot-head").append(box);
  }

  function fit(p) {
    const width = "print" in root.dataset ? Math.min(PRINT_WIDTH, p.body.clientWidth || PRINT_WIDTH) : p.body.clientWidth;
    if (width < 50) return;
    const tall = p.group ? 0.45 : 0.8;
    // Lower on paper: two time plots and the summary fit the first page.
    const most = "print" in root.dataset ? (p.group ? 230 : 340) : (p.group ? 280 : 440);
    const height = Math.round(Math.max(220, Math.min(most, width * tall)));
    if (p.u.width !== width || p.u.height !== height) p.u.setSize({ width: width, height: height });
  }

  function redraw() {
    for (const p of plots) { fit(p); p.u.redraw(true, true); }
  }

  function draw(spec, index) {
    const figure = document.getElementById("plot-" + index);
    const body = figure.querySelector(".plot-body");
    try {
      const p = { spec: spec, body: body, group: null, u: null };
      if (spec.kind !== "xy") {
        p.group = groups.get(groupKey(spec));
        p.group.plots.push(p);
      }
      body.classList.add(spec.kind);
      const data = spec.kind === "xy" ? [null].concat(spec.data) : spec.data;
      p.u = new uPlot(options(p, spec), data, body);
      const canvas = p.u.root.querySelector("canvas");
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", body.getAttribute("aria-label"));
      p.u.over.addEventListener("wheel", e => {
        // The bare wheel scrolls the page, as everywhere.
        if (!e.ctrlKey && !e.metaKey) return;
        e.preventDefault();
        const r = p.u.over.getBoundingClientRect();
        zoomAt(p, Math.pow(1.002, e.deltaY), (e.clientX - r.left) / r.width, 1 - (e.clientY - r.top) / r.height);
      }, { passive: false });
      plots.push(p);
      fit(p);
      dressLegend(p, spec);
      addButtons(p, figure);
    } catch (error) {
      fail(body, error);
    }
  }

  let specs = [];
  try {
    specs = JSON.parse(document.getElementById("plot-data").textContent);
  } catch (error) {
    fail(null, error);
  }
  specs.forEach((spec, i) => {
    if (spec.kind === "xy") return;
    const g = groups.get(groupKey(spec)) || { key: "x" + i, xs: [], plots: [] };
    g.xs.push(spec.data[0]);
    g.full = padded(...extremes(g.xs), 0);
    groups.set(groupKey(spec), g);
  });
  specs.forEach(draw);

  new ResizeObserver(() => { if (!("print" in root.dataset)) plots.forEach(fit); }).observe(document.querySelector("main"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  window.addEventListener("beforeprint", () => { root.dataset.print = ""; redraw(); });
  window.addEventListener("afterprint", () => { delete root.dataset.print; redraw(); });

  // For tests and the curious: the plots and their zoom.
  window.bristlePlots = { plots: plots, zoom: zoom, reset: reset };
})();
