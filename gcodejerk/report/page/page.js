// The page: one rapid is chosen at a time, in the table or in a view, and shown everywhere.

const data = JSON.parse(document.getElementById("data").textContent);
const unit = data.unit;
const PLANNED = 255, ALL_AXES = 255, AXES = "XYZABCUVW", STANDSTILL = 1e-9;
const PRINTED = {
  paper: "#fff", sheet: "#fff", ink: "#000", soft: "#444", line: "#bbb", before: "#b3501b",
  after: "#0b57a4", band: "rgba(40, 120, 80, 0.14)", feed: "#b4bbc4", left: "#8b949e", mark: "#d1006c",
};

const unpackAll = (record, names) => Object.fromEntries(names.map((n) => [n, unpack(record[n])]));
const rapids = {
  ...data.rapids,
  ...unpackAll(data.rapids, ["line", "reason", "words", "mode", "before", "after"]),
  ...unpackAll(data.rapids, ["waited", "waits", "time", "usual"]),
  start: data.rapids.start.map(unpack),
  end: data.rapids.end.map(unpack),
};
const curves = {
  ...unpackAll(data.rapids.curves, ["first", "before", "after", "axis"]),
  profiles: unpackAll(data.rapids.curves.profiles, ["first", "duration", "acceleration", "jerk"]),
};
const modes = {
  ...data.modes,
  ...unpackAll(data.modes, ["group", "decay", "omega", "participation"]),
};
const rotary = (axis) => data.rotary.includes(axis);

// Numbers as people read them: three digits that count, never an exponent.
function grouped(x) {
  return String(Math.round(x)).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}
function figure(x) {
  if (x !== x) return "?";
  if (x === Infinity) return "without end";
  const size = Math.abs(x);
  if (size === 0) return "0";
  if (size >= 999.5) return grouped(x);
  const decimals = Math.min(Math.max(2 - Math.floor(Math.log10(size)), 0), 6);
  const text = x.toFixed(decimals);
  return decimals > 2 ? text.replace(/\.?0+$/, "") : text;
}
const small = (mm) => figure(mm * unit.smallPerMm);
const position = (mm, axis) =>
  mm === mm ? String(Number((rotary(axis) ? mm : mm * unit.perMm).toFixed(4))) : "?";
const planned = (i) => rapids.reason[i] === PLANNED;
const why = (i) => data.reasons[rapids.reason[i]];

// What each axis of AXES moves in a rapid [mm, deg].
function way(i) {
  const out = new Float64Array(9);
  rapids.axes.forEach((axis, k) => {
    const moved = rapids.end[k][i] - rapids.start[k][i];
    const at = AXES.indexOf(axis);
    if ((rapids.words[i] >> at) & 1 && Math.abs(moved) > STANDSTILL) out[at] = moved;
  });
  return out;
}
function lengthOf(i) {
  let linear = 0, turning = 0;
  rapids.axes.forEach((axis, k) => {
    if (!((rapids.words[i] >> AXES.indexOf(axis)) & 1)) return;
    const moved = rapids.end[k][i] - rapids.start[k][i];
    if (rotary(axis)) turning += moved * moved;
    else linear += moved * moved;
  });
  return linear > 0 || linear !== linear ? Math.sqrt(linear) : Math.sqrt(turning);
}
const lengths = Float64Array.from({ length: rapids.count }, (_, i) => lengthOf(i));
const saved = (i) => {
  const gain = rapids.waited[i] - rapids.waits[i];
  return gain === gain ? gain : NaN;
};
function positions(column, i) {
  const parts = rapids.axes
    .map((axis, k) => ((rapids.words[i] >> AXES.indexOf(axis)) & 1 ? axis + position(column[k][i], axis) : ""))
    .filter(Boolean);
  return parts.join(" ") || "–";
}

function element(name, text, className) {
  const made = document.createElement(name);
  made.textContent = text;
  if (className) made.className = className;
  return made;
}
const dash = (text) => (text === "?" ? "–" : text);
const columns = [
  { key: "line", head: "Line", kind: "n c-line", show: (i) => String(rapids.line[i]), value: (i) => rapids.line[i] },
  {
    key: "block", head: "Block", kind: "",
    show: (i) => {
      const code = element("code", rapids.block[i]);
      code.title = rapids.block[i];
      return planned(i) ? [code] : [code, element("span", why(i), "why")];
    },
    value: (i) => rapids.block[i],
  },
  { key: "length", head: `Length [${unit.length}]`, kind: "n wide c-num", down: true,
    show: (i) => rotaryOnly(i) ? `${figure(lengths[i])} deg` : dash(figure(lengths[i] * unit.perMm)),
    value: (i) => lengths[i] },
  { key: "before", head: `Vibration before [${unit.small}]`, kind: "n c-num", down: true,
    show: (i) => dash(small(rapids.before[i])), value: (i) => rapids.before[i] },
  { key: "after", head: `Vibration now [${unit.small}]`, kind: "n c-num", down: true,
    show: (i) => dash(small(rapids.after[i])), value: (i) => rapids.after[i] },
  { key: "saved", head: "Waiting saved [ms]", kind: "n wide c-num", down: true,
    show: (i) => dash(figure(1e3 * saved(i))), value: saved },
  { key: "status", head: "Status", kind: "wide c-status",
    show: (i) => (planned(i) ? "rewritten" : element("span", why(i), "left")),
    value: (i) => (planned(i) ? "" : why(i)) },
];

function matches(i, filter) {
  const line = rapids.line[i];
  if (filter.lines && !(line >= filter.lines[0] && line <= filter.lines[1])) return false;
  if (filter.status && (filter.status === "planned") !== planned(i)) return false;
  if (filter.reason && String(rapids.reason[i]) !== filter.reason) return false;
  return !filter.text || rapids.block[i].toLowerCase().includes(filter.text);
}

// How things are drawn now: the colours of the theme, or those of paper.
const darkness = window.matchMedia("(prefers-color-scheme: dark)");
let printing = false, chosen = -1;
const scale = new Scale([rapids.before, rapids.after], data.tolerance);
function paint() {
  const style = getComputedStyle(document.documentElement);
  const colours = printing
    ? PRINTED
    : Object.fromEntries(Object.keys(PRINTED).map((n) => [n, style.getPropertyValue(`--${n}`).trim()]));
  const column = document.querySelector("input[name=colour]:checked").value === "before" ? rapids.before : rapids.after;
  return {
    colours, scale, unit, chosen, planned, printing, choose: (i) => choose(i, true),
    ramp: rampOf(darkness.matches && !printing), value: (i) => column[i],
  };
}

function drawLegend() {
  const holder = document.getElementById("legend"), { ramp, colours } = paint();
  const bar = element("div", "", "ramp");
  bar.style.background = `linear-gradient(to right, ${ramp.join(",")})`;
  const ticks = element("div", "", "ticks");
  const marks = [scale.low];
  for (let x = 10 ** Math.ceil(Math.log10(scale.low * 1.6)); x < scale.high / 1.6; x *= 10) marks.push(x);
  marks.push(scale.high);
  const shown = marks.length > 6 ? marks.filter((_, k) => k % 2 === 0 || k === marks.length - 1) : marks;
  for (const mark of shown) {
    const tick = element("span", `${mark === scale.low ? "≤ " : ""}${Number(small(mark).replace(/[^0-9.]/g, ""))}${mark === scale.high ? ` ${unit.small}` : ""}`);
    tick.style.left = `${100 * scale.place(mark)}%`;
    ticks.append(tick);
  }
  const keys = element("div", "", "keys");
  const key = (text, colour, dashes, width) => {
    const ns = "http://www.w3.org/2000/svg", svg = document.createElementNS(ns, "svg");
    const line = document.createElementNS(ns, "line");
    for (const [name, value] of Object.entries({ width: 26, height: 8 })) svg.setAttribute(name, value);
    const looks = { x1: 0, x2: 26, y1: 4, y2: 4, stroke: colour, "stroke-width": width, "stroke-dasharray": dashes };
    for (const [name, value] of Object.entries(looks)) line.setAttribute(name, value);
    svg.append(line);
    const item = element("span", "");
    item.append(svg, text);
    keys.append(item);
  };
  key("left alone", ramp[SHADES >> 1], "6 4", 2);
  key("not known", colours.left, "2 3", 1.5);
  key("feed", colours.feed, "", 1.2);
  holder.replaceChildren(bar, ticks, keys);
}

// The pieces that carry a rapid, and the way of each; before or after. Empty: there are none.
function carriedBy(i, when) {
  const all = way(i), out = [];
  for (let k = curves.first[i]; k < curves.first[i + 1]; k++) {
    const axis = curves.axis[k];
    const own = axis === ALL_AXES ? all : all.map((x, a) => (a === axis ? x : 0));
    out.push({ pieces: piecesOf(curves.profiles, curves[when][k]), way: own, axis });
  }
  return out;
}
const lastOf = (carried) => Math.max(0, ...carried.map((part) => totalOf(part.pieces)));

const charts = { acceleration: null, vibration: null };
function chart(id, times, series, ends, band) {
  const holder = document.getElementById(id), { colours } = paint();
  const size = () => ({ width: Math.max(holder.clientWidth, 200), height: 190 });
  if (charts[id]) charts[id].destroy();
  const font = "12px system-ui, sans-serif";
  const axis = { stroke: colours.soft, font, grid: { stroke: colours.line, width: 0.5 }, ticks: { stroke: colours.line, size: 4 } };
  const dashes = { before: [6, 4], after: undefined };
  const mark = (u) => {
    const { ctx, bbox } = u, ratio = window.devicePixelRatio || 1;
    ctx.save();
    for (const [name, end] of ends) {
      const x = u.valToPos(1e3 * end, "x", true);
      ctx.strokeStyle = colours[name];
      ctx.lineWidth = ratio;
      ctx.setLineDash([2 * ratio, 3 * ratio]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  };
  const settled = (u) => {
    if (!band) return;
    const { ctx, bbox } = u, ratio = window.devicePixelRatio || 1;
    const high = u.valToPos(band, "y", true), low = u.valToPos(-band, "y", true);
    ctx.save();
    ctx.fillStyle = colours.band;
    ctx.fillRect(bbox.left, high - ratio, bbox.width, Math.max(low - high, 0) + 2 * ratio);
    ctx.restore();
  };
  const options = {
    ...size(),
    scales: { x: { time: false }, y: { range: (u, low, high) => range(low, high) } },
    axes: [
      { ...axis, size: 30, values: (u, ticks) => ticks.map((x, k) => (k === ticks.length - 1 ? `${x} ms` : String(x))) },
      { ...axis, size: 58, values: (u, ticks) => ticks.map((x) => (Math.abs(x) >= 1e3 ? grouped(x) : String(Number(x.toPrecision(3))))) },
    ],
    cursor: { drag: { x: false, y: false }, sync: { key: "chosen" } },
    legend: { live: !printing },
    series: [
      { label: "ms", value: (u, x) => (x === null ? "–" : figure(x)) },
      ...series.map(({ name, label }) => ({
        label, stroke: colours[name], width: name === "after" ? 2 : 1.6,
        dash: dashes[name], points: { show: false }, spanGaps: true,
        value: (u, x) => (x === null || x === undefined ? "–" : figure(x)),
      })),
    ],
    hooks: { drawClear: [settled], draw: [mark] },
  };
  holder.replaceChildren();
  charts[id] = new uPlot(options, [times, ...series.map((each) => each.values)], holder);
  charts[id].resized = () => charts[id].setSize(size());
}
function range(low, high) {
  const most = Math.max(Math.abs(low || 0), Math.abs(high || 0)) * 1.08 || 1;
  return [low < 0 ? -most : 0, most]; // an envelope is never below 0
}

// Before and after at the same moments, however many corners each has.
function aligned(all) {
  const times = [...new Set(all.flatMap((corners) => corners.map(([t]) => t)))].sort((a, b) => a - b);
  const both = times.flatMap((t) => [t, t]);
  const values = all.map((corners) => {
    const out = [];
    for (const t of times) {
      const here = corners.filter((corner) => Math.abs(corner[0] - t) < 1e-12);
      if (here.length) out.push(here[0][1], here[here.length - 1][1]);
      else {
        const next = corners.findIndex((corner) => corner[0] > t);
        if (next < 1) out.push(null, null);
        else {
          const [[a, x], [b, y]] = [corners[next - 1], corners[next]];
          const value = x + ((y - x) * (t - a)) / (b - a);
          out.push(value, value);
        }
      }
    }
    return out;
  });
  return { times: both.map((t) => 1e3 * t), values };
}

function fill(select, options, value) {
  select.replaceChildren(...options.map(([key, text]) => {
    const option = element("option", text);
    option.value = key;
    return option;
  }));
  select.value = value;
}

function drawCurves() {
  if (chosen < 0) return;
  const before = carriedBy(chosen, "before"), after = planned(chosen) ? carriedBy(chosen, "after") : [];
  const nothing = document.getElementById("no-curves");
  document.getElementById("curves").hidden = !before.length;
  nothing.hidden = Boolean(before.length);
  if (!before.length) {
    nothing.textContent = planned(chosen)
      ? "The curves of this rapid are not on this page, which holds those of the rapids that leave the most."
      : "No curves: where this rapid starts or ends, or how the control runs it, is not known.";
    return;
  }
  const shown = [["before", "today", before], ["after", "planned", after]].filter(([, , c]) => c.length);
  const ends = shown.map(([name, , carried]) => [name, lastOf(carried)]);
  const arrival = Math.max(...ends.map(([, end]) => end));
  const modeBox = document.getElementById("mode"), mode = Number(modeBox.value);
  const swings = modeBox.options.length > 0;
  const frequency = swings ? modes.frequency[mode] : 0;
  const until = arrival + (swings ? Math.min(Math.max(6 / frequency, 0.3 * arrival), 1.5) : 0.1 * arrival);
  drawAcceleration(shown, ends, until);
  document.getElementById("vibration").hidden = document.getElementById("mode-choice").hidden = !swings;
  if (swings) drawVibration(shown, ends, until, mode, frequency);
}

function drawAcceleration(shown, ends, until) {
  const box = document.getElementById("axis"), letter = box.value;
  const along = letter === "path";
  const deg = along ? rotaryOnly(chosen) : rotary(letter);
  const factor = deg ? 1 : unit.perMm;
  const parts = shown.map(([, , carried]) => {
    const part = along ? carried[0] : carried.find((p) => p.axis === ALL_AXES || AXES[p.axis] === letter);
    const size = along ? lengths[chosen] : part.way[AXES.indexOf(letter)];
    const corners = accelerationCorners(part.pieces, size * factor);
    return [...corners, [until, 0]];
  });
  const { times, values } = aligned(parts);
  const name = `${deg ? "deg" : unit.length}/s²`;
  const series = shown.map(([key, label], k) => ({ name: key, label, values: values[k] }));
  chart("acceleration", times, series, ends, 0);
  document.getElementById("acceleration-title").textContent = `Acceleration [${name}]`;
  const peaks = series.map((s) => `${s.label} up to ${figure(Math.max(...s.values.map((x) => Math.abs(x || 0))))} ${name}`);
  document.getElementById("acceleration").setAttribute("aria-label",
    `Acceleration ${along ? "along the path" : `of ${letter}`} over time: ${peaks.join(", ")}.`);
}
const rotaryOnly = (i) => {
  const moved = [...AXES].filter((_, a) => way(i)[a]);
  return moved.length > 0 && moved.every(rotary);
};

function drawVibration(shown, ends, until, mode, frequency) {
  const count = Math.min(Math.max(Math.ceil(24 * until * frequency), 600), 6000);
  const times = Float64Array.from({ length: count + 1 }, (_, k) => (until * k) / count);
  const series = shown.map(([name, label, carried]) => ({
    name, label, values: Array.from(vibration(carried, modes, mode, times), (x) => x * unit.smallPerMm),
  }));
  const together = modes.group.filter((g) => g === mode).length > 1;
  document.getElementById("vibration-title").textContent =
    `Vibration [${unit.small}]${together ? ", envelope" : ""}`;
  document.getElementById("mode").title = modes.name[mode];
  chart("vibration", Array.from(times, (t) => 1e3 * t), series, ends, data.tolerance * unit.smallPerMm);
  const said = series.map((s, k) => {
    const rest = s.values.filter((_, n) => times[n] >= ends[k][1]);
    return `${s.label} up to ${figure(Math.max(...rest.map(Math.abs)))} ${unit.small} after arrival at ${figure(1e3 * ends[k][1])} ms`;
  });
  document.getElementById("vibration").setAttribute("aria-label",
    `Vibration of the mode ${modes.name[mode]} over time: ${said.join("; ")}.`);
}

function fillChoices(i) {
  const all = way(i);
  const excited = [];
  for (let m = 0; m < modes.group.length; m++) {
    const counts = [...AXES].some((_, a) => all[a] && modes.participation[9 * m + a]);
    if (counts && !excited.includes(modes.group[m])) excited.push(modes.group[m]);
  }
  const texts = excited.map((g) => [g, `${modes.name[g]} (${modes.axes[g]}, ${figure(modes.frequency[g])} Hz)`]);
  fill(document.getElementById("mode"), texts, excited.includes(rapids.mode[i]) ? rapids.mode[i] : excited[0]);
  const moving = [...AXES].filter((_, a) => all[a]);
  const own = data.positioning === "linear" ? [["path", "path"]] : moving.map((axis) => [axis, axis]);
  fill(document.getElementById("axis"), own, own.length ? own[0][0] : "");
  document.getElementById("axis-choice").hidden = own.length < 2;
}

function describe(i) {
  document.querySelector("#chosen-block code").textContent = rapids.block[i];
  document.getElementById("chosen-title").textContent = `Rapid of line ${rapids.line[i]}`;
  const what = document.getElementById("chosen-what");
  what.textContent = planned(i) ? `Rewritten: ${data.profile}.` : `Left alone: ${why(i)}.`;
  const arrow = (a, b) => (a === b || b === "?" ? (a === "?" ? "not known" : a) : `${a} → ${b}`);
  const length = figure(lengths[i] * (rotaryOnly(i) ? 1 : unit.perMm));
  const facts = [
    ["From", positions(rapids.start, i)],
    ["To", positions(rapids.end, i)],
    ["Length", length === "?" ? "not known" : `${length} ${rotaryOnly(i) ? "deg" : unit.length}`],
    ["Time [ms]", arrow(figure(1e3 * rapids.usual[i]), figure(1e3 * rapids.time[i]))],
    [`Vibration [${unit.small}]`, arrow(small(rapids.before[i]), small(rapids.after[i]))],
    ["Then waiting [ms]", arrow(figure(1e3 * rapids.waited[i]), figure(1e3 * rapids.waits[i]))],
  ];
  document.getElementById("facts").replaceChildren(...facts.map(([name, value]) => {
    const item = document.createElement("div");
    item.append(element("dt", name), element("dd", value));
    return item;
  }));
  return `Line ${rapids.line[i]}, ${rapids.block[i]}: ${what.textContent} Vibration ${facts[4][1]} ${unit.small}.`;
}

function choose(i, scroll) {
  if (i === chosen && !scroll) return;
  chosen = i;
  table.mark(i);
  const text = describe(i);
  fillChoices(i);
  drawCurves();
  views.forEach((view) => view.draw());
  if (started) document.getElementById("said").textContent = text;
  if (scroll && window.matchMedia("(max-width: 62rem)").matches)
    document.getElementById("chosen").scrollIntoView({ block: "start" });
}

function readFilter() {
  const lines = document.getElementById("filter-lines").value.match(/\d+/g);
  const from = lines ? Number(lines[0]) : 0;
  return {
    lines: lines ? [from, lines.length > 1 ? Number(lines[1]) : from] : null,
    status: document.getElementById("filter-status").value,
    reason: document.getElementById("filter-reason").value,
    text: document.getElementById("filter-text").value.trim().toLowerCase(),
  };
}

function describeViews(scene) {
  const range = (k) => `${"XYZ"[k]} ${position(scene.low[k], "X")} to ${position(scene.high[k], "X")} ${unit.length}`;
  let done = 0, most = 0;
  for (let i = 0; i < rapids.count; i++) {
    if (planned(i)) done++;
    if (rapids.after[i] > most) most = rapids.after[i];
  }
  const what = scene.empty ? "No place of any move is known." :
    `${grouped(scene.drawn.length)} rapids and the feed moves; ${range(0)}, ${range(1)}, ${range(2)}. ` +
    `${grouped(done)} rapids are rewritten; the most that is left is ${small(most)} ${unit.small}. The table has every number.`;
  const [top, space] = document.querySelectorAll(".view canvas");
  top.setAttribute("aria-label", `Tool path from above. ${what} Arrow keys move the view, plus and minus zoom.`);
  space.setAttribute("aria-label", `Tool path in space. ${what} Arrow keys turn the view, plus and minus zoom.`);
  const hidden = rapids.count - scene.drawn.length;
  document.getElementById("drawn").textContent =
    hidden ? `Not drawn: ${grouped(hidden)} ${hidden === 1 ? "rapid" : "rapids"} whose start or end is not known.` : "";
}

if (!rapids.after.some((x) => x === x))
  document.querySelector("input[name=colour][value=before]").checked = true;
let started = false, table, views = [];
document.body.classList.add("drawn");
if (rapids.count) {
  const reasonBox = document.getElementById("filter-reason"), counts = new Map();
  for (let i = 0; i < rapids.count; i++)
    if (!planned(i)) counts.set(rapids.reason[i], (counts.get(rapids.reason[i]) || 0) + 1);
  for (const [code, count] of [...counts].sort((a, b) => b[1] - a[1])) {
    const option = element("option", `${data.reasons[code]} (${grouped(count)})`);
    option.value = code;
    reasonBox.append(option);
  }
  const scene = new Scene(rapids, unpack(data.feed));
  describeViews(scene);
  table = new RapidTable(rapids.count, columns, matches, choose);
  views = [
    new View(document.getElementById("top-view"), scene, paint, false),
    new View(document.getElementById("space-view"), scene, paint, true),
  ];
  const form = document.getElementById("filter");
  const refilter = () => table.setFilter(readFilter());
  form.addEventListener("input", refilter);
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(refilter));
  for (const button of document.querySelectorAll(".show"))
    button.addEventListener("click", () => {
      form.reset();
      document.getElementById("filter-reason").value = button.dataset.reason;
      refilter();
      document.getElementById("rapids").scrollIntoView({ block: "start" });
      document.getElementById("filter-reason").focus({ preventScroll: true });
    });
  document.getElementById("colour-by").addEventListener("change", () => views.forEach((view) => view.draw()));
  document.getElementById("mode").addEventListener("change", drawCurves);
  document.getElementById("axis").addEventListener("change", drawCurves);
  const repaint = () => {
    drawLegend();
    drawCurves();
    views.forEach((view) => (printing ? view.drawNow() : view.draw()));
  };
  darkness.addEventListener("change", repaint);
  new ResizeObserver(() => Object.values(charts).forEach((each) => each && each.resized()))
    .observe(document.getElementById("chosen"));
  const print = (on) => {
    printing = on;
    repaint();
  };
  window.addEventListener("beforeprint", () => print(true));
  window.addEventListener("afterprint", () => print(false));
  drawLegend();
  choose(table.order[0], false);
}
started = true;
window.gcodejerkReport = { vibration, carriedBy, modes, rapids, choose: (i) => choose(i, false) };
