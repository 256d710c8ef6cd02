"use strict";
// The sliders: keys of the design -> row of the simulator -> loops, margins, curves and a run, all in the module.
// The statements from keys to row are those of an export in C; this file only interprets them.
(() => {
  const holder = document.getElementById("live-data"), root = document.getElementById("hands-on");
  if (!holder || !root || typeof WebAssembly !== "object") return;
  const data = JSON.parse(holder.textContent);
  const number = (value) => (typeof value === "string" ? Number(value.replace("inf", "Infinity")) : value);
  const find = (selector) => root.querySelector(selector);
  const html = (name, className, text) => {
    const made = document.createElement(name);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  };

  // --- the statements ------------------------------------------------------------------------------------
  const FUNCTIONS = {
    pow: Math.pow, tan: Math.tan, sqrt: Math.sqrt, sin: Math.sin, cos: Math.cos, exp: Math.exp, log: Math.log,
    floor: Math.floor, ceil: Math.ceil, fabs: Math.abs, zero_below: (x, least) => (Math.abs(x) < least ? 0 : x),
    where: (condition, yes, no) => (condition ? yes : no),
  };
  const SIGNS = {
    "+": (a, b) => a + b, "-": (a, b) => a - b, "*": (a, b) => a * b, "/": (a, b) => a / b,
    "<": (a, b) => +(a < b), "<=": (a, b) => +(a <= b), ">": (a, b) => +(a > b), ">=": (a, b) => +(a >= b),
    "==": (a, b) => +(a === b), "!=": (a, b) => +(a !== b), "&&": (a, b) => +(a && b), "||": (a, b) => +(a || b),
  };
  const expression = (text) => {
    let m = /^k\[(\d+)\]$/.exec(text);
    if (m) { const n = +m[1]; return (k) => k[n]; }
    m = /^v(\d+)$/.exec(text);
    if (m) { const n = +m[1]; return (k, v) => v[n]; }
    m = /^(\w+)\((.*)\)$/.exec(text);
    if (m && FUNCTIONS[m[1]]) {
      const run = FUNCTIONS[m[1]], parts = m[2].split(", ").map(expression);
      if (parts.length > 2) return (k, v) => run(parts[0](k, v), parts[1](k, v), parts[2](k, v));
      return parts.length > 1 ? (k, v) => run(parts[0](k, v), parts[1](k, v)) : (k, v) => run(parts[0](k, v));
    }
    m = /^(\S+) (\S+) (\S+)$/.exec(text);
    if (m && SIGNS[m[2]]) {
      const run = SIGNS[m[2]], a = expression(m[1]), b = expression(m[3]);
      return (k, v) => run(a(k, v), b(k, v));
    }
    m = /^-([kv].*)$/.exec(text);
    if (m) { const inner = expression(m[1]); return (k, v) => -inner(k, v); }
    const value = text === "INFINITY" ? Infinity : text === "(-INFINITY)" ? -Infinity : text === "NAN" ? NaN : Number(text);
    if (text === "" || (Number.isNaN(value) && text !== "NAN")) throw new Error("statement: " + text);
    return () => value;
  };
  const statement = (line) => {
    let m = /^const double v(\d+) = (.+);$/.exec(line);
    if (m) { const n = +m[1], of = expression(m[2]); return (k, v) => { v[n] = of(k, v); return true; }; }
    m = /^p\[(\d+)\] = (.+);$/.exec(line);
    if (m) { const n = +m[1], of = expression(m[2]); return (k, v, p) => { p[n] = of(k, v); return true; }; }
    m = /^if \((!?)\((.+)\)\) \{ return 0; \}$/.exec(line);
    if (m) { const refuses = m[1] === "", of = expression(m[2]); return (k, v) => Boolean(of(k, v)) !== refuses; }
    throw new Error("statement: " + line);
  };
  const statements = data.lines.map(statement);
  const base = Float64Array.from(data.row, number);
  const rowOf = (values) => {
    const p = base.slice(), v = [];
    return statements.every((run) => run(values, v, p)) ? p : null;
  };
  // a figure of the whole drive: NaN where it has none, null where it needs another structure of the drive
  const drive = data.requirements.map((item) => item.lines && item.lines.map(statement));
  const driveOf = (values) => drive.map((lines) => {
    const p = [], v = [];
    return lines && lines.every((run) => run(values, v, p)) ? p[0] : null;
  });

  // --- words ---------------------------------------------------------------------------------------------
  const minus = (text) => text.replace(/-/g, "−");
  const digits = (value, count) => {
    if (value === Infinity) return "unlimited";
    if (!Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.floor(Math.log10(Math.abs(value)));
    if (size < -4 || size > 6) return minus(value.toExponential(Math.max(count - 1, 0)));
    return minus(value.toFixed(Math.min(Math.max(count - 1 - size, 0), 12)));
  };
  const PLACE = Object.fromEntries(data.quantities.map((name, k) => [name, k]));
  const STABLE = data.quantities.length;
  const LOOP_NAMES = { current: "Current loop", velocity: "Velocity loop", position: "Position loop" };
  const POINT_NAMES = { "at w_ref": "Cut at the speed command", "at i_ref": "Cut at the current command", "at u": "Cut at the voltage" };

  const BEHIND = -9, DOUBT = -3, QUIET = 150, SLICE = 12, TOO_SLOW = 6; // ms

  // --- the module ----------------------------------------------------------------------------------------
  let x = null;
  const view = (at, count) => new Float64Array(x.memory.buffer, at, count);
  const stageOf = (name) => data.stages[name];
  const outer = data.loops[data.loops.length - 1];
  const slow = new Set(); // loops whose step takes too long for a moving slider: a slow pole beside a short period
  const compute = (values, whole) => {
    const row = rowOf(values);
    if (!row) return null;
    view(x.p_at(), row.length).set(row);
    const found = { row, drive: driveOf(values), loops: {}, points: {} };
    for (const name of data.loops) {
      const began = performance.now(), timed = whole || !slow.has(name);
      found.loops[name] = figures(stageOf(name), timed ? 1 : 0);
      found.loops[name].waits = !timed;
      if (performance.now() - began > TOO_SLOW) slow.add(name);
    }
    for (const name in data.points) found.points[name] = x.phases_of(data.points[name]) > 1 ? { n: BEHIND } : figures(data.points[name], 0);
    return found;
  };
  // what takes too long for a moving slider: once nothing has moved for a moment, one piece at a time
  let pieces = [], waits = 0;
  const nextPiece = () => {
    const end = performance.now() + SLICE;
    while (pieces.length && performance.now() < end) pieces.shift()();
    if (!pieces.length) { root.dataset.behind = "done"; return; }
    waits = setTimeout(nextPiece, 0);
  };
  const fillBehind = () => {
    clearTimeout(waits);
    root.dataset.behind = "waits";
    pieces = [...timedPieces(now), ...periodicPieces(before), ...(now === before ? [] : periodicPieces(now)), table, ...mapPieces(now)];
    waits = setTimeout(nextPiece, QUIET);
  };
  let sines = null, mapGrid = null, inView = false;
  const mapPieces = (found) => {
    const loop = found.loops[outer];
    if (found.cells) { drawMap(found.cells); return []; }
    drawMap([]);
    if (!sines || !mapGrid || !inView || !loop.figures || loop.figures[STABLE] !== 1) return [];
    const { hertz, amplitude } = mapGrid, { row } = found, cells = [];
    const tones = hertz.map((f) => sines.toneOf(f, row[data.places.outer] * row[data.places.period]));
    const settling = loop.figures[PLACE.settling_time], wait = 1.5 * (Number.isFinite(settling) ? settling : 400 * loop.period);
    const ticks = sines.startUp(row, wait);
    let linear = null;
    const listed = [() => { linear = sines.linearAt(row, tones.map((tone) => tone.hertz)); }];
    for (let j = amplitude.length - 1; j >= 0; j--) {
      for (let k = 0; k < tones.length; k++) listed.push(() => {
        const cause = linear && sines.cell(row, tones[k], amplitude[j], linear[k], ticks);
        if (cause) cells.push({ j, k, cause, ticks, tone: tones[k], amplitude: amplitude[j] });
      });
      listed.push(() => drawMap(cells));
    }
    listed.push(() => { found.cells = cells; });
    return listed;
  };
  const drawMap = (cells) => {
    if (!mapGrid) return;
    const edges = (list, k) => { const half = Math.sqrt(list[1] / list[0]); return [list[k] / half, list[k] * half]; };
    const { hertz, amplitude } = mapGrid;
    tell("border", "chart:cells", { panel: 0, cells: cells.filter(({ cause }) => cause !== "none").map(({ j, k, cause }) => ({
      x: edges(hertz, k), y: edges(amplitude, j).map((value) => value / data.step.factor), colour: sines.COLOURS[cause], words: data.map.words[cause],
    })) });
    const seen = [...new Set(cells.map(({ cause }) => cause))], line = find(".map-keys");
    line.replaceChildren(...(seen.length ? [html("span", "", "Sine from rest, simulated: ")] : []), ...seen.map((cause) => {
      const item = html("span", "map-key", data.map.words[cause]);
      if (cause !== "none") { const box = html("i"); box.style.background = `var(--${sines.COLOURS[cause]})`; item.prepend(box); }
      return item;
    }));
    root.dataset.cells = JSON.stringify(cells.map(({ cause, ticks, tone, amplitude }) => [cause, ticks, tone.hertz, tone.count, amplitude]));
  };
  const timedPieces = (found) => data.loops.filter((name) => found.loops[name].waits).map((name) => () => {
    view(x.p_at(), found.row.length).set(found.row);
    found.loops[name] = figures(stageOf(name), 1);
    state();
  });
  const periodicPieces = (found) => Object.keys(data.points).filter((name) => found.points[name].n === BEHIND).map((name) => () => {
    view(x.p_at(), found.row.length).set(found.row);
    found.points[name] = figures(data.points[name], 0);
  });
  const figures = (stage, timed) => {
    const n = x.loop(stage, timed);
    if (n <= 0) return { n };
    if (x.doubtful(stage)) return { n: DOUBT };
    const found = Array.from(view(x.figures_at(stage), STABLE + 1));
    return { n, figures: found, period: x.period_of(stage) };
  };
  const respond = (name, hertz) => {
    const stage = stageOf(name), angle = 2 * Math.PI * x.period_of(stage);
    view(x.x_at(), hertz.length).set(hertz.map((f) => f * angle));
    if (x.respond(stage, hertz.length) <= 0) return null;
    const pairs = view(x.y_at(), 2 * hertz.length), re = [], im = [];
    for (let k = 0; k < hertz.length; k++) { re.push(pairs[2 * k]); im.push(pairs[2 * k + 1]); }
    return { re, im };
  };
  const stepOf = (name, count) => {
    let stage = stageOf(name);
    if (name === "position" && Number.isNaN(x.lead_of(stage))) stage = 3; // the whole path from the command
    return x.step_of(stage, count) > 0 ? Array.from(view(x.y_at(), count)) : null;
  };
  // command amplitude at which each limit is just reached, over frequency
  const borderOf = (row, hertz) => {
    const ratio = row[data.places.ratio], T = row[data.places.outer], count = hertz.length;
    const period = T * row[data.places.period];
    view(x.p_at(), row.length).set(row);
    view(x.x_at(), count).set(hertz.map((f) => Math.min(2 * Math.PI * f * period, Math.PI)));
    if (x.limiters(count) <= 0) return null;
    const sizes = view(x.y_at(), 6 * count), input = data.step.of === "speed" ? ratio : 1;
    const each = data.limits.map(([name, place, line]) => [name, hertz.map((f, k) => row[place] / (input * sizes[line * count + k]) / data.step.factor / (sines ? Math.abs(sines.meanAt(row, f * period)[0]) : 1))]);
    return { each, lowest: hertz.map((_, k) => Math.min(...each.map(([, values]) => values[k]))) };
  };
  // the drive with all its limits and its friction, from rest; command and output as shares of the scale
  let acted = 0; // limiters, as bits
  const run = (count, command, scale, moment) => {
    acted = 0;
    if (!x.start()) return null;
    const at = data.places, io = view(x.io_at(), x.io_length()), out = new Float64Array(count);
    const ratio = view(x.p_at(), at.ratio + 1)[at.ratio];
    const place = { output: at.output, speed: at.speed, current: at.current }[data.step.of];
    const over = data.step.of === "speed" ? ratio * scale : scale;
    for (let k = 0; k < count; k++) {
      io[at.command] = command(k);
      io[at.moment] = moment;
      if (x.tick() !== 0) return out.subarray(0, k);
      acted |= io[at.flags];
      out[k] = io[place] / over;
    }
    return out;
  };

  // --- sliders -------------------------------------------------------------------------------------------
  const keys = data.keys, start = keys.map((key) => key.value);
  let values = start.slice(), past = [], future = [], before = null, now = null, shown = outer, record = null, refused = "";
  const same = (a, b) => a.every((value, k) => value === b[k]);
  const share = (key, value) => (key.low > 0 ? Math.log(value / key.low) / Math.log(key.high / key.low) : (value - key.low) / (key.high - key.low));
  const along = (key, part) => (key.low > 0 ? key.low * (key.high / key.low) ** part : key.low + part * (key.high - key.low));
  const valueAt = (key, part) => (key.whole ? Math.round(along(key, part)) : along(key, part));
  const allowed = (key, value) => Number.isFinite(value) && (key.low > 0 ? value > 0 : key.low < 0 || value >= 0) && (!key.whole || Number.isInteger(value));
  const inUnit = (key, value) => value / key.factor;
  const said = (key, value) => (key.whole ? String(value) : digits(inUnit(key, value), 4));
  const OPEN = matchMedia("(max-width: 60rem)").matches ? ["control.position", "control.velocity"] : ["control", "control.position", "control.velocity", "control.current"];
  const ORDER = ["control.position", "control.velocity", "control.current", "control", "encoder", "command", "limits", "friction", "load", "supply", "motor", "gear"];
  const titleOf = (path) => path.split(".").slice(0, -1).join(".");
  const rank = (title) => { const k = ORDER.findIndex((name) => title === name || title.startsWith(name + ".")); return k < 0 ? 99 : k; };

  const rows = [];
  const makeSlider = (key, k) => {
    const row = html("div", "row"), id = `hand-${k}`;
    row.dataset.path = key.path;
    const label = html("label", "", key.path.slice(titleOf(key.path).length + 1).replaceAll("_", " "));
    label.htmlFor = id;
    label.title = key.about;
    const track = html("div", "track");
    if (key.band) {
      const band = html("i", "band"), from = Math.max(share(key, Math.max(key.band[0], key.low)), 0), to = Math.min(share(key, key.band[1]), 1);
      band.style.left = `${100 * from}%`;
      band.style.width = `${100 * (to - from)}%`;
      band.title = "tolerance of the design file";
      track.append(band);
    }
    const origin = html("i", "origin");
    origin.style.left = `${100 * share(key, key.value)}%`;
    const range = html("input");
    range.type = "range";
    range.id = id;
    range.min = 0;
    range.max = 1000;
    range.step = "any";
    range.setAttribute("aria-description", key.about);
    const field = html("input", "field");
    field.type = "text";
    field.inputMode = "decimal";
    field.setAttribute("aria-label", `${key.path}${key.unit ? ", " + key.unit : ""}`);
    track.append(origin, range);
    range.addEventListener("input", () => preview(k, valueAt(key, range.value / 1000)));
    range.addEventListener("change", () => commit());
    range.addEventListener("keydown", (event) => {
      const move = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 }[event.key];
      if (!move) return;
      event.preventDefault();
      const to = valueAt(key, Math.min(1, Math.max(0, share(key, values[k]) + move / 200)));
      preview(k, key.whole && to === values[k] ? Math.min(key.high, Math.max(key.low, to + Math.sign(move))) : to);
      commit();
    });
    range.addEventListener("dblclick", () => { preview(k, key.value); commit(); });
    field.addEventListener("change", () => {
      const typed = Number(field.value.replace(",", ".").replace("−", "-"));
      if (field.value.trim() !== "" && allowed(key, typed * key.factor)) { preview(k, typed === inUnit(key, key.value) ? key.value : typed * key.factor); commit(); }
      else show();
    });
    const was = html("span", "was");
    row.append(label, field, html("span", "unit", key.unit), track, was);
    return { key, row, range, field, was };
  };
  const makePanel = () => {
    const groups = new Map();
    keys.forEach((key, k) => {
      const slider = makeSlider(key, k), title = titleOf(key.path);
      rows.push(slider);
      if (!groups.has(title)) groups.set(title, []);
      groups.get(title).push(slider.row);
    });
    const box = find(".keys-of");
    for (const title of [...groups.keys()].sort((a, b) => rank(a) - rank(b))) {
      const group = html("details", "group");
      group.open = OPEN.includes(title);
      const unused = (row) => (keys.find((key) => key.path === row.dataset.path).value === 0 ? 1 : 0);
      group.append(html("summary", "", title), ...groups.get(title).sort((a, b) => unused(a) - unused(b)));
      box.append(group);
    }
    const fixed = html("details", "group fixed"), list = html("ul");
    fixed.append(html("summary", "", `${data.fixed.length} keys without a slider`));
    for (const key of data.fixed) {
      const item = html("li"), value = key.whole ? String(key.value) : digits(inUnit(key, key.value), 5);
      item.append(html("code", "", key.path), ` ${value} ${key.unit}: ${key.why}.`);
      list.append(item);
    }
    fixed.append(list);
    if (data.fixed.length) box.append(fixed);
  };

  // --- changing ------------------------------------------------------------------------------------------
  let settled = start.slice(), lastGood = start.slice(), waiting = false;
  const preview = (k, value) => {
    values = values.slice();
    values[k] = value;
    later();
  };
  const commit = () => {
    if (same(values, settled)) return;
    past.push(settled);
    future = [];
    settled = values.slice();
    later();
    remember();
  };
  const go = (from, to) => {
    if (!from.length) return;
    to.push(settled);
    settled = from.pop();
    values = settled.slice();
    later();
    remember();
  };
  const later = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; update(); });
  };
  const changes = () => keys.map((key, k) => [key, values[k]]).filter(([key, value]) => value !== key.value);
  const fragment = () => "#hands-on" + (changes().length ? "?" + changes().map(([key, value]) => `${encodeURIComponent(key.path)}=${value}`).join("&") : "");
  const remember = () => { try { history.replaceState(null, "", changes().length ? fragment() : location.pathname + location.search); } catch { /* a place without a history */ } };
  const fromFragment = () => {
    const text = location.hash;
    if (!text.startsWith("#hands-on?")) return;
    let told;
    try { told = new Map(text.slice(10).split("&").map((part) => part.split("=")).map(([path, value]) => [decodeURIComponent(path), Number(value || NaN)])); } catch { return; }
    values = keys.map((key) => (allowed(key, told.get(key.path)) ? told.get(key.path) : key.value));
    commit();
    root.scrollIntoView();
  };

  // --- showing -------------------------------------------------------------------------------------------
  const chart = (name) => find(`[data-chart="${name}"] .chart`);
  const tell = (name, type, detail) => chart(name).dispatchEvent(new CustomEvent(type, { detail }));
  // a requirement as found: its value (NaN: none), and whether it is met (null: not proven)
  const judged = (found) => data.requirements.map((item, k) => {
    const loop = found.loops[item.loop];
    if (item.loop && (!loop || !loop.figures)) return { item, value: NaN, met: null };
    if (item.loop && loop.figures[STABLE] !== 1) return { item, value: NaN, met: false, words: "unstable" };
    if (item.loop && loop.waits && item.timed) return { item, value: NaN, met: null, words: "…" };
    let value = item.loop ? loop.figures[PLACE[item.quantity]] : found.drive[k] ?? NaN;
    if (item.absolute) value = Math.abs(value);
    return { item, value, met: Number.isNaN(value) ? null : value >= (item.minimum ?? -Infinity) && value <= (item.maximum ?? Infinity) };
  });
  const calm = (value, unit) => (["dB", "deg", "%"].includes(unit) && Math.abs(value) < 1 ? Math.round(value * 1e4) / 1e4 : value); // no -3e-5 dB
  const cell = (now, was, factor, loop, name, unit) => {
    const made = html("td", "right"), value = calm(now * factor, unit), old = calm(was * factor, unit);
    made.dataset.loop = loop;
    made.dataset.figure = name;
    made.dataset.value = now;
    made.append(html("b", "", digits(value, 4)));
    if (digits(value, 4) !== digits(old, 4)) made.append(html("span", "was", `was ${digits(old, 4)}`));
    return made;
  };
  const NONE = { "-1": "not followed here: too many states for this page", [DOUBT]: "stability not known: rounding decides its figures", [BEHIND]: "follows in a moment" };
  const table = () => {
    const head = html("tr");
    const heading = (words, side, scope) => {
      const th = html("th", side, words);
      th.scope = scope;
      return th;
    };
    head.append(heading("Loop", "left", "col"));
    for (const { label, unit } of data.figures) {
      const th = heading(label + " ", "right", "col");
      th.append(html("span", "unit", unit));
      head.append(th);
    }
    const body = [], bad = new Set(judged(now).filter(({ met }) => met === false).map(({ item }) => item.loop + " " + item.quantity));
    for (const name of [...data.loops, ...Object.keys(data.points)]) {
      const own = now.loops[name] || now.points[name], old = before.loops[name] || before.points[name];
      if (own.n === 0 && !(name in now.loops)) continue; // no such break point
      const row = html("tr"), th = heading(LOOP_NAMES[name] || POINT_NAMES[name], "left", "row");
      row.append(th);
      if (!own.figures || !old.figures) {
        const td = html("td", "", NONE[own.figures ? old.n : own.n] || "no loop");
        td.colSpan = data.figures.length;
        row.append(td);
      } else {
        if (x.phases_of(stageOf(name) ?? data.points[name]) > 1) th.append(" ", html("span", "unit", "fundamental"));
        if (own.figures[STABLE] !== 1) th.append(" ", html("span", "mark fail", "unstable"));
        th.dataset.loop = name;
        th.dataset.stable = own.figures[STABLE];
        for (const { name: quantity, unit, factor, timed, response } of data.figures) {
          if (name in now.points && response) { // of a break point it says nothing
            row.append(html("td"));
            continue;
          }
          if (own.waits && timed) {
            row.append(html("td", "right", "…"));
            continue;
          }
          const k = PLACE[quantity], td = cell(own.figures[k], old.figures[k], factor, name, quantity, unit);
          if (bad.has(name + " " + quantity)) td.classList.add("bad");
          row.append(td);
        }
      }
      body.push(row);
    }
    const top = html("thead"), rest = html("tbody");
    top.append(head);
    rest.append(...body);
    const box = find("table.now");
    box.replaceChildren(box.querySelector("caption"), top, rest);
  };
  const state = () => {
    const line = find(".state"), all = judged(now), was = judged(before), total = all.length;
    const fails = all.filter(({ met }) => met === false), old = was.filter(({ met }) => met === false), open = all.filter(({ met, words }) => met === null && words !== "…");
    const unstable = data.loops.filter((name) => now.loops[name].figures && now.loops[name].figures[STABLE] !== 1);
    const unknown = data.loops.filter((name) => now.loops[name].n === DOUBT), words = [];
    if (unknown.length) words.push(`Stability not known: ${unknown.join(", ")}.`);
    if (unstable.length) words.push(`Unstable: ${unstable.join(", ")}.`);
    const met = all.filter((one) => one.met).length, count = (many, word) => (many ? `, ${many} ${word}` : "");
    const designed = changes().length ? ` (as designed: ${old.length} not met)` : "";
    if (total) words.push(`${met} of ${total} requirements met${count(fails.length, "not met")}${count(open.length, "not proven")}${designed}.`);
    else if (!data.apart.length) words.push("The design states no requirements.");
    if (data.apart.length) words.push(`${data.apart.length} found by a simulation of its own ${data.apart.length === 1 ? "does" : "do"} not follow: ${[...new Set(data.apart.map((item) => item.words))].join(", ")}.`);
    if (refused) words.push(refused);
    line.className = `state ${unstable.length || fails.length ? "fail" : unknown.length || open.length ? "warn" : total ? "pass" : "info"}`;
    line.textContent = words.filter(Boolean).join(" ");
    line.dataset.failing = fails.length;
    demands(all, was);
  };
  const placed = (item) => (item.loop ? LOOP_NAMES[item.loop] : item.load ? `at ${minus(String(item.load))} ${data.axis === "linear" ? "N" : "N m"}` : "");
  const demands = (all, was) => {
    const box = find("table.demands");
    box.closest(".scroll").hidden = !all.length;
    const top = html("tr"), limit = ({ minimum, maximum }) => [minimum !== null ? `≥ ${minus(String(minimum))}` : "", maximum !== null ? `≤ ${minus(String(maximum))}` : ""].filter(Boolean).join(", ");
    for (const [words, side] of [["Requirement", "left"], ["Where", "left"], ["Limit", "right"], ["As designed", "right"], ["As changed", "right"], ["Verdict", "left"]]) {
      const th = html("th", side, words);
      th.scope = "col";
      top.append(th);
    }
    const rest = all.map(({ item, value, met, words }, k) => {
      const row = html("tr"), th = html("th", "left", item.words[0].toUpperCase() + item.words.slice(1)), last = html("td", "left");
      th.scope = "row";
      th.title = item.id;
      const found = (one) => one.words || `${digits(calm(one.value, one.item.unit), 4)} ${one.item.unit}`;
      const cellNow = html("td", met === false ? "right bad" : "right", found({ item, value, words }));
      row.dataset.id = item.id;
      row.dataset.loop = item.loop || "";
      row.dataset.value = value;
      row.dataset.met = met;
      last.append(html("span", `mark ${met === null ? "warn" : met ? "pass" : "fail"}`, met === null ? "not proven" : met ? "met" : was[k].met === false ? "not met" : "now not met"));
      row.append(th, html("td", "left", placed(item)), html("td", "right", `${limit(item)} ${item.unit}`), html("td", "right", found(was[k])), cellNow, last);
      return row;
    });
    const head = html("thead"), body = html("tbody");
    head.append(top);
    body.append(...rest);
    box.replaceChildren(box.querySelector("caption"), head, body);
  };
  const show = () => {
    rows.forEach((slider, k) => {
      const { key } = slider, value = values[k], moved = value !== key.value;
      if (document.activeElement !== slider.range || !slider.range.matches(":active")) slider.range.value = 1000 * Math.min(1, Math.max(0, share(key, value)));
      slider.range.setAttribute("aria-valuetext", `${said(key, value)} ${key.unit}`);
      if (document.activeElement !== slider.field) slider.field.value = said(key, value).replace("−", "-");
      slider.row.classList.toggle("moved", moved);
      slider.was.textContent = moved ? `was ${said(key, key.value)}` : "";
    });
    const doing = { undo: past.length, redo: future.length, reset: changes().length };
    for (const name in doing) find(`[data-do="${name}"]`).disabled = !doing[name];
  };

  // --- figures -------------------------------------------------------------------------------------------
  const grid = (name) => {
    const own = before.loops[name], top = 0.5 / own.period * (1 - 1e-4), band = own.figures[PLACE.bandwidth];
    const low = Math.min(Number.isFinite(band) && band > 0 ? band / 100 : top / 1e4, top / 30), points = [];
    for (let k = 0; k <= 320; k++) points.push(low * (top / low) ** (k / 320));
    return points;
  };
  const unwrapped = (re, im, hertz) => {
    const phase = [];
    let last = null, turn = 0;
    const slope = Math.round(Math.log(Math.hypot(re[1], im[1]) / Math.hypot(re[0], im[0])) / Math.log(hertz[1] / hertz[0])) || 0;
    for (let k = 0; k < re.length; k++) {
      let angle = Math.atan2(im[k], re[k]) * 180 / Math.PI;
      if (last === null) turn = -360 * Math.ceil((angle - 90 * slope - 90) / 360); // as actuator_lti.phase's branch
      if (last !== null) turn -= 360 * Math.round((angle + turn - last) / 360);
      angle += turn;
      phase.push(angle);
      last = angle;
    }
    return phase;
  };
  const db = (value) => 20 * Math.log10(value);
  const curvesOf = (name, hertz) => {
    const found = respond(name, hertz);
    if (!found) return null;
    const { re, im } = found, s = [], t = [];
    for (let k = 0; k < re.length; k++) {
      const distance = Math.hypot(1 + re[k], im[k]);
      s.push(-db(distance));
      t.push(db(Math.hypot(re[k], im[k]) / distance));
    }
    return { re, im, gain: re.map((_, k) => db(Math.hypot(re[k], im[k]))), phase: unwrapped(re, im, hertz), s, t };
  };
  const CUT = 2.5 * 1.6;
  const near = (curves) => curves.re.map((value, k) => Math.hypot(1 + value, curves.im[k]) < CUT);
  let kept = {}; // the curves as designed, by loop
  const designed = (name) => {
    if (kept[name]) return kept[name];
    const hertz = grid(name), own = before.loops[name];
    const settling = own.figures[PLACE.settling_time], end = Number.isFinite(settling) && settling > 0 ? 2.2 * settling : 400 * own.period;
    const count = Math.min(Math.max(Math.ceil(end / own.period), 40), 3000);
    kept[name] = { hertz, curves: curvesOf(name, hertz), step: stepOf(name, count), count };
    return kept[name];
  };
  const thinned = (count, most = 700) => Math.max(1, Math.ceil(count / most));
  const draw = (label, part, name) => {
    const { hertz } = kept[name], { curves, step } = part, keep = curves && near(curves);
    if (curves) {
      tell("bode", "chart:redraw", { panel: 0, curve: label, x: hertz, y: curves.gain });
      tell("bode", "chart:redraw", { panel: 1, curve: label, x: hertz, y: curves.phase });
      const cut = (list) => list.map((value, k) => (keep[k] ? value : NaN));
      tell("nyquist", "chart:redraw", { panel: 0, curve: label, x: cut(curves.re), y: cut(curves.im), parameter: hertz });
      tell("sensitivity", "chart:redraw", { panel: 0, curve: "S " + label, x: hertz, y: curves.s });
      tell("sensitivity", "chart:redraw", { panel: 0, curve: "T " + label, x: hertz, y: curves.t });
    }
    if (!step) return;
    const T = (label === "as designed" ? before : now).loops[name].period * 1e3, stride = thinned(step.length);
    const at = step.map((_, k) => k).filter((k) => k % stride === 0);
    tell("step", "chart:redraw", { panel: 0, curve: label, x: at.map((k) => k * T), y: at.map((k) => step[k]) });
  };
  const range = (list, low, high) => [Math.max(low, Math.min(...list.filter(Number.isFinite))), Math.min(high, Math.max(...list.filter(Number.isFinite)))];
  const frame = (name) => {
    const part = kept[name], ends = [part.hertz[0], part.hertz[part.hertz.length - 1]], { gain, phase, s, t } = part.curves;
    const [low, high] = range(gain, -90, 90), [lag, lead] = range(phase, -900, 180), [, peak] = range([...s, ...t], -60, 60);
    tell("bode", "chart:axes", { panel: 0, x: ends, y: [Math.max(low, high - 100) - 6, high + 12] });
    tell("bode", "chart:axes", { panel: 1, x: ends, y: [lag - 60, lead + 30] });
    tell("sensitivity", "chart:axes", { panel: 0, x: ends, y: [-45, Math.max(peak, 3) + 9] });
    const end = part.count * before.loops[name].period * 1e3;
    tell("step", "chart:axes", { panel: 0, x: [0, end], y: [-0.1, Math.max(1.5, Math.max(...(part.step || [1])) + 0.2)] });
    tell("step", "chart:redraw", { panel: 0, curve: "command", x: [0, end], y: [1, 1] });
  };

  // --- the run with limits and friction -------------------------------------------------------------------
  let size = data.step.size, moment = 0, length = 0, runBefore = null;
  const held = (rec, T) => {
    let place = 0;
    return (k) => {
      if (k === 0) place = 0;
      while (place + 1 < rec.time.length && rec.time[place + 1] <= k * T + 1e-12) place++;
      return rec.command[place];
    };
  };
  const trial = (row) => {
    view(x.p_at(), row.length).set(row);
    const T = row[data.places.period], scale = record ? record.scale : size;
    const count = Math.min(Math.max(Math.ceil(length / T), 2), 60000);
    return { T, y: run(count, record ? held(record, T) : () => size, scale, moment) };
  };
  const measure = () => { // how long the run as designed takes
    const T = before.row[data.places.period];
    if (record) { length = record.time[record.time.length - 1]; return; }
    view(x.p_at(), before.row.length).set(before.row);
    const y = run(Math.min(Math.ceil(6 / T), 6000), () => size, size, moment) || [];
    let last = 0;
    for (let k = 0; k < y.length; k++) if (Math.abs(y[k] - 1) > 0.02) last = k;
    length = Math.max(1.4 * last, 60) * T;
  };
  const drawRun = (label, part, unit) => {
    if (!part.y) return;
    const stride = thinned(part.y.length, 900), at = [];
    for (let k = 0; k < part.y.length; k += stride) at.push(k);
    tell("run", "chart:redraw", { panel: 0, curve: label, x: at.map((k) => k * part.T * unit), y: at.map((k) => part.y[k]) });
  };
  const unitOf = () => (length < 2 ? [1e3, "ms"] : [1, "s"]);
  const runStart = () => {
    measure();
    runBefore = trial(before.row);
    const [unit, words] = unitOf(), top = record ? 1.35 : Math.max(1.3, ...(runBefore.y || [1])) + 0.1, low = record ? record.low - 0.15 : -0.1;
    tell("run", "chart:axes", { panel: 0, x: [0, length * unit], y: [low, top], words });
    drawRun("as designed", runBefore, unit);
    const line = record ? [record.time.map((t) => t * unit), record.command.map((value) => value / record.scale)] : [[0, length * unit], [1, 1]];
    tell("run", "chart:redraw", { panel: 0, curve: "command", x: line[0], y: line[1] });
    const dots = record ? [record.time.map((t) => t * unit), record.angle.map((value) => value / record.scale)] : [[], []];
    tell("run", "chart:redraw", { panel: 0, curve: "measured record", x: dots[0], y: dots[1] });
  };
  const misfit = (part) => {
    let sum = 0, n = 0;
    record.time.forEach((t, k) => {
      const at = Math.round(t / part.T);
      if (at < part.y.length) { sum += (part.y[at] - record.angle[k] / record.scale) ** 2; n++; }
    });
    return n ? 100 * Math.sqrt(sum / n) : NaN;
  };

  let borderGrid = [], borderUnit = "";
  const drawBorder = (label, part) => {
    if (!part) return;
    tell("border", "chart:redraw", { panel: 0, curve: `lowest, ${label}`, x: borderGrid, y: part.lowest });
    if (label === "as changed") for (const name of data.borders) {
      const own = part.each.find(([known]) => known === name);
      tell("border", "chart:redraw", { panel: 0, curve: name, x: own ? borderGrid : [], y: own ? own[1] : [] });
    }
  };
  const borderStart = () => {
    const row = before.row, top = 0.5 / (row[data.places.outer] * row[data.places.period]), band = before.loops[outer].figures;
    const low = band && Number.isFinite(band[PLACE.bandwidth]) ? Math.min(band[PLACE.bandwidth] / 30, top / 30) : top / 1e3;
    borderGrid = [];
    for (let k = 0; k <= 90; k++) borderGrid.push(low * (0.98 * top / low) ** (k / 90));
    const part = borderOf(row, borderGrid);
    if (!part) { chart("border").closest(".four > div").hidden = true; return; }
    if (data.map && Number.isFinite(band[PLACE.bandwidth])) mapGrid = sines.gridOf(Math.max(low, band[PLACE.bandwidth] / 25), Math.min(band[PLACE.bandwidth] * 8, 0.8 * top), data.map.full);
    const [, high] = range([...part.lowest.slice(0, 1), size / data.step.factor], 0, 1e30), [bottom] = range(part.lowest, 0, 1e30);
    const ends = mapGrid ? mapGrid.amplitude.map((value) => value / data.step.factor) : [bottom];
    tell("border", "chart:axes", { panel: 0, x: [borderGrid[0], borderGrid[90]], y: [Math.max(Math.min(bottom, ends[0]) / 4, high / 1e7), Math.max(high * 8, ends[ends.length - 1] * 2)] });
    drawBorder("as designed", part);
  };

  const unfit = (wanted) => { // why values do not go together; empty where they do
    const at = (path) => wanted[keys.findIndex((key) => key.path === path)];
    for (const [path, of] of data.multiples) if (at(path) % at(of) > 0) return `${path} = ${at(path)} is no multiple of ${of} = ${at(of)}: nothing follows until it is one.`;
    return "";
  };
  const update = () => {
    const began = performance.now();
    refused = "";
    const apart = unfit(values), found = apart ? null : compute(values);
    if (found && data.loops.every((name) => found.loops[name].n !== 0)) { now = found; lastGood = values; } else {
      refused = apart || "The last value needs another structure of the drive: save the file and make a new report.";
      now = { ...now, ...compute(keys.map((key, k) => lastGood[k])) };
    }
    show();
    table();
    state();
    if (now.loops[shown].figures && kept[shown]) draw("as changed", { curves: curvesOf(shown, kept[shown].hertz), step: stepOf(shown, Math.min(Math.ceil(kept[shown].count * before.loops[shown].period / now.loops[shown].period), 3000)) }, shown);
    drawBorder("as changed", borderOf(now.row, borderGrid));
    const part = trial(now.row);
    drawRun("as changed", part, unitOf()[0]);
    const acting = data.limiters.filter(([, bit]) => acted & bit).map(([name]) => name);
    find(".acting").textContent = acting.length ? `Limits that act as changed: ${acting.join(", ")}.` : "No limit acts as changed.";
    if (record && part.y) find(".record").textContent = `${record.name}: ${record.time.length} samples. Model as changed: ${digits(misfit(part), 3)} % rms of the largest command; as designed: ${digits(misfit(runBefore), 3)} %.`;
    root.dataset.ms = (performance.now() - began).toFixed(1);
    fillBehind();
    root.dataset.count = +(root.dataset.count || 0) + 1;
  };
  const choose = (name) => {
    shown = name;
    for (const button of root.querySelectorAll(".tabs button")) button.setAttribute("aria-pressed", String(button.dataset.loop === name));
    compute(start);
    designed(name);
    frame(name);
    draw("as designed", kept[name], name);
    update();
  };

  // --- file, link, record ---------------------------------------------------------------------------------
  const changedText = () => {
    const places = data.patches.map((patch, k) => [patch, k]).filter(([, k]) => values[k] !== start[k]).sort((a, b) => a[0][0] - b[0][0] || a[0][1] - b[0][1]);
    let text = "", at = 0;
    const letters = [...data.text];
    for (const [[from, to, lead, tail], k] of places) {
      const key = keys[k], value = inUnit(key, values[k]);
      text += letters.slice(at, from).join("") + lead + (key.unit ? `"${value} ${key.unit}"` : String(Number.isInteger(value) && !key.whole ? value.toFixed(1) : value)) + tail;
      at = to;
    }
    return text + letters.slice(at).join("");
  };
  const save = () => {
    const link = html("a"), address = URL.createObjectURL(new Blob([changedText()], { type: "text/plain" }));
    link.href = address;
    link.download = `${data.name.replace(/[^\w.-]/g, "_") || "design"}-changed.toml`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  };
  const sheet = (text) => {
    const box = find(".sheet"), area = box.querySelector("textarea");
    area.value = text;
    box.hidden = false;
    area.focus();
    area.select();
  };
  const copy = () => {
    const area = find(".sheet textarea");
    area.select();
    if (navigator.clipboard) navigator.clipboard.writeText(area.value).catch(() => document.execCommand("copy"));
    else document.execCommand("copy");
  };
  const parse = (name, text) => {
    const lines = text.split(/\r?\n/).map((line) => line.trim()).filter((line) => line && !line.startsWith("#"));
    const cut = lines[0].includes(";") ? ";" : lines[0].includes("\t") ? "\t" : ",";
    const head = lines[0].split(cut).map((word) => word.trim().replace(/^"|"$/g, ""));
    const titled = head.some((word) => Number.isNaN(Number(word)));
    const column = (pattern, otherwise) => { const k = titled ? head.findIndex((word) => pattern.test(word)) : otherwise; return k; };
    const at = [column(/^t(ime)?\b|^time/i, 0), column(/comm|^cmd|ref|target|demand/i, 1), column(/angle|pos|output|meas|actual|speed|current/i, 2)];
    if (at[0] < 0 || at[1] < 0) throw new Error("no column for time, or none for the command");
    if (at[2] < 0 || at[2] === at[1]) at[2] = head.findIndex((word, k) => k !== at[0] && k !== at[1] && /angle|pos|output|meas|actual|speed|current/i.test(word));
    if (at[2] < 0) throw new Error("no column for the angle");
    const factor = (k) => (titled && /deg|°/i.test(head[k]) ? Math.PI / 180 : titled && /(_|\b)mm\b|_mm/i.test(head[k]) ? 1e-3 : 1);
    const inTime = titled && /(_|\b)ms\b|_ms/i.test(head[at[0]]) ? 1e-3 : 1;
    const table = lines.slice(titled ? 1 : 0).map((line) => line.split(cut).map(Number)).filter((row) => at.every((k) => Number.isFinite(row[k])));
    if (table.length < 2) throw new Error("fewer than two rows of numbers");
    const first = table[0][at[0]], time = table.map((row) => (row[at[0]] - first) * inTime);
    if (time.some((t, k) => k && t < time[k - 1])) throw new Error("time runs backwards");
    const command = table.map((row) => row[at[1]] * factor(at[1])), angle = table.map((row) => row[at[2]] * factor(at[2]));
    const scale = command.reduce((most, value) => Math.max(most, Math.abs(value)), 0) || 1;
    return { name, time, command, angle, scale, low: Math.min(0, ...range([...command, ...angle], -1e30, 1e30)) / scale };
  };
  const take = async (file) => {
    try {
      record = parse(file.name, await file.text());
      compute(start);
      runStart();
      update();
    } catch (error) {
      find(".record").textContent = `${file.name}: ${error.message}.`;
    }
  };
  const runKeys = () => {
    const box = find(".run-keys"), { unit, factor } = data.step;
    const make = (words, value, apply) => {
      const label = html("label", "", words + " "), field = html("input", "field");
      field.type = "text";
      field.inputMode = "decimal";
      field.value = digits(value, 4);
      field.addEventListener("change", () => {
        const typed = Number(field.value.replace(",", "."));
        if (!Number.isFinite(typed)) return;
        apply(typed);
        compute(start);
        runStart();
        update();
      });
      label.append(field);
      box.append(label);
    };
    make(`Command, ${unit}:`, size / factor, (value) => { if (value !== 0) size = value * factor; });
    if (data.step.of === "output") make(data.axis === "linear" ? "Load force, N:" : "Load torque, N m:", 0, (value) => { moment = value; });
  };

  const begin = () => {
    root.hidden = false;
    document.querySelectorAll(".to-hands").forEach((item) => (item.hidden = false));
    makePanel();
    before = now = compute(start, true);
    slow.clear(); // the first run pays for the compiler
    if (!before) throw new Error("the design as written is refused");
    const followed = data.loops.filter((name) => before.loops[name].figures);
    if (!followed.includes(shown)) shown = followed[followed.length - 1];
    for (const name of followed) {
      const button = html("button", "", LOOP_NAMES[name]);
      button.type = "button";
      button.dataset.loop = name;
      button.addEventListener("click", () => choose(name));
      find(".tabs").append(button);
    }
    sines = data.map ? sineMap({ x, view, data }) : null;
    new IntersectionObserver(([entry]) => {
      if (entry.isIntersecting === inView) return;
      inView = entry.isIntersecting;
      if (inView && root.dataset.ready) fillBehind();
    }, { rootMargin: "200px" }).observe(chart("border"));
    runKeys();
    runStart();
    borderStart();
    choose(shown);
    const acts = {
      undo: () => go(past, future), redo: () => go(future, past), reset: () => { values = start.slice(); commit(); },
      save, file: () => sheet(changedText()), link: () => sheet(location.href.split("#")[0] + fragment()),
      copy, close: () => { find(".sheet").hidden = true; },
    };
    root.addEventListener("click", (event) => {
      const button = event.target.closest("[data-do]");
      if (button) acts[button.dataset.do]();
    });
    root.addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.target.matches("textarea, .field")) return;
      if (event.key === "z" && !event.shiftKey) acts.undo();
      else if (event.key === "y" || (event.key === "z" && event.shiftKey)) acts.redo();
      else return;
      event.preventDefault();
    });
    find('input[type="file"]').addEventListener("change", (event) => { if (event.target.files[0]) take(event.target.files[0]); });
    addEventListener("dragover", (event) => { if ([...event.dataTransfer.types].includes("Files")) event.preventDefault(); });
    addEventListener("drop", (event) => {
      if (!event.dataTransfer.files.length) return;
      event.preventDefault();
      take(event.dataTransfer.files[0]);
    });
    addEventListener("hashchange", fromFragment);
    fromFragment();
    root.dataset.ready = "1";
  };
  const bytes = Uint8Array.from(atob(document.getElementById("live-module").textContent.trim()), (letter) => letter.charCodeAt(0));
  WebAssembly.instantiate(bytes, {}).then(({ instance }) => {
    x = instance.exports;
    x._initialize();
    begin();
  });
})();
