// What one changes: numbers and choices, anchors on the side view, times of the valves.
import { dom, number, svg } from "./figures.js";

const GROUPS = ["patient", "device", "air", "timing"];
const SIGNS = { "N*m*s/rad": "N·m·s/rad", deg: "°" };
const read = text => { const plain = text.trim().replace("−", "-").replace(",", "."); return plain !== "" && Number.isFinite(Number(plain)) ? Number(plain) : text.trim() || null; };
const sign = unit => SIGNS[unit] ?? unit.replaceAll("*", "·");
const round = value => Math.round(100 * value) / 100;
const place = text => text.replace(/\W+/g, "-");

/** A text field that keeps what was typed until it is taken; what is wrong with it stands in its own words below. */
class Field {
  constructor(key, label, send) {
    const id = place(`field-${key}`);
    this.problem = dom("p", { class: "problem", role: "alert", id: `${id}-problem`, hidden: true });
    this.input = dom("input", { id, inputmode: "decimal", autocomplete: "off", "aria-label": label, "aria-describedby": `${id}-problem`, "data-key": key });
    this.dirty = false;
    this.input.addEventListener("input", () => (this.dirty = true));
    this.input.addEventListener("change", () => { this.dirty = true; send(read(this.input.value)); });
    this.input.addEventListener("keydown", event => { if (event.key === "Escape") { this.good(); this.write(this.value, true); } });
  }

  /** Show the design's value; not over what somebody types, or what is wrong. */
  write(value, by_force = false) {
    this.value = value;
    if (!this.dirty || by_force) this.input.value = value === null || value === undefined ? "" : String(Number.isFinite(value) ? +value.toPrecision(6) : value);
  }

  /** The value was taken. */
  good() {
    this.dirty = false;
    this.problem.hidden = true;
    this.input.removeAttribute("aria-invalid");
  }

  /** It was not. */
  bad(text) {
    this.problem.hidden = false;
    this.problem.textContent = text;
    this.input.setAttribute("aria-invalid", "true");
  }
}

/** One control of the state, as a row: slider and field, or a choice. */
class Row {
  constructor(control, studio) {
    const { key, label, unit } = control, id = place(`row-${key}`), title = dom("label", { for: control.choices.length ? id : place(`field-${key}`) }, label);
    this.source = dom("details", { class: "source" }, dom("summary"), dom("p"), dom("p"), dom("p"));
    this.why = dom("p", { class: "meaning" });
    this.field = new Field(key, null, value => studio.change({ [key]: value }, { fresh: true }));
    if (control.choices.length) {
      this.select = dom("select", { id, "data-key": key, "aria-describedby": this.field.problem.id });
      this.select.addEventListener("change", () => studio.change({ [key]: this.select.value || null }, { fresh: true }));
      this.element = dom("div", { class: "row" }, title, this.source, this.select, this.field.problem, this.why);
    } else {
      const { low, high, step } = control;
      this.slider = dom("input", { type: "range", min: low, max: high, step, "aria-label": `${label}, slider`, "data-key": key });
      this.slider.addEventListener("input", event => {
        this.field.good();
        this.field.write(Number(this.slider.value));
        this.slider.removeAttribute("aria-valuetext");
        studio.change({ [key]: Number(this.slider.value) }, { time: event.timeStamp });
      });
      this.element = dom("div", { class: "row" }, title, this.source, this.slider, this.field.input, dom("span", { class: "unit" }, sign(unit)), this.field.problem, this.why);
    }
    this.element.addEventListener("pointerdown", event => { if (event.target === this.slider) studio.hold(key); });
  }

  write(control, held) {
    const [mark, ...texts] = this.source.children, word = { set: "set here" }[control.source] ?? (control.kind || (control.source === "default" ? "not stated" : "from file"));
    mark.textContent = word;
    mark.title = control.reference;
    mark.setAttribute("aria-label", `${word}: source of ${control.label}`);
    this.why.textContent = control.idle;
    for (const each of [this.slider, this.select, this.field.input]) if (each) each.disabled = control.idle !== "";
    [`Source: ${control.reference}`, `Allowed: ${control.allowed}`, control.meaning].forEach((text, k) => (texts[k].textContent = text));
    if (held) return;
    if (this.select) this.choose(control);
    else {
      this.field.write(control.value);
      this.field.input.placeholder = "none";
      this.slider.value = control.value ?? (control.low + control.high) / 2;
      if (control.value === null) this.slider.setAttribute("aria-valuetext", "none");
    }
  }

  choose(control) {
    const names = [...control.choices], value = control.value ?? "";
    if (value && !names.some(([name]) => name === value)) names.unshift([value, value]);
    if (!value || control.source === "set") names.unshift(["", value ? "as before it was set here" : "none"]);
    const listed = JSON.stringify(names);
    if (listed !== this.listed) this.select.replaceChildren(...names.map(([name, words]) => dom("option", { value: name }, words || name)));
    this.listed = listed;
    this.select.value = value;
  }
}

/** The anchors: rings on a side view to scale that are dragged, and their coordinates [mm]. */
class SideView {
  constructor(box, fields, studio) {
    Object.assign(this, { fields, studio, handles: {} });
    this.leg = svg("path", { class: "leg" });
    this.lines = svg("g");
    this.rings = svg("g");
    this.drawing = svg("svg", { viewBox: "-150 -400 390 520", role: "group", "aria-label": "Side view of the device" }, this.leg, this.lines, this.rings);
    box.append(this.drawing);
  }

  /** Outline of shank and foot, upright and flat, from the frame in which the sole is flattest. */
  outline(poses) {
    const tilt = sole => Math.abs(Math.atan2(sole[1][1] - sole[0][1], sole[1][0] - sole[0][0]));
    const k = poses.sole.reduce((best, sole, n) => (tilt(sole) < tilt(poses.sole[best]) ? n : best), 0);
    const [ankle, knee] = [poses.ankle[k], poses.knee[k]], mm = point => [1e3 * (point[0] - ankle[0]), -1e3 * (point[1] - ankle[1])];
    const [heel, ball, pulp, tip] = poses.sole[k].map(mm), length = 1e3 * Math.hypot(knee[0] - ankle[0], knee[1] - ankle[1]);
    this.leg.setAttribute("d", `M-38 0L-48 ${-0.7 * length}V${-length}H44V${-0.7 * length}L34 -8L${ball[0] - 20} ${ball[1] - 42}L${tip} L${pulp} L${ball} L${heel} L${heel[0] + 3} ${heel[1] - 50}Z`);
  }

  write(anchors, links, held) {
    this.links = links;
    const names = Object.keys(anchors), groups = [...new Set(names.map(name => name.split(" ")[0]))];
    if (names.join() !== Object.keys(this.handles).join()) this.build(anchors, groups);
    for (const name of names) if (!held(`${anchors[name].key}[0]`)) this.place(name, anchors[name].x, anchors[name].z);
    const reach = Math.max(...names.map(name => anchors[name].z), 300) + 50, width = Math.max(...names.map(name => Math.abs(anchors[name].x)), 130) + 25;
    if (!this.studio.holds()) this.drawing.setAttribute("viewBox", `${-width} ${-reach} ${Math.max(width + 215, 2 * width)} ${reach + 125}`);
  }

  build(anchors, groups) {
    this.handles = {};
    this.rings.replaceChildren();
    this.lines.replaceChildren();
    this.fields.replaceChildren();
    this.muscles = Object.fromEntries(groups.map((group, k) => {
      const line = style => this.lines.appendChild(svg("line", { class: `muscle ${style} ${k ? "second" : ""}` }));
      const name = this.lines.appendChild(svg("text", { "text-anchor": "middle" }, group));
      return [group, [line("link"), line(""), name]];
    }));
    for (const [name, { key }] of Object.entries(anchors)) {
      const fields = ["0", "2"].map((axis, n) => new Field(`${key}[${axis}]`, `${name}, ${["forward", "up"][n]}, mm`, value => this.studio.change({ [`${key}[${axis}]`]: value }, { fresh: true })));
      this.fields.append(dom("div", { class: "pair" }, dom("span", {}, name), ...fields.map(field => field.input), dom("span", { class: "unit" }, "mm"), ...fields.map(field => field.problem)));
      const ring = svg("g", { class: `handle ${name.startsWith(groups[0]) ? "" : "second"}`, role: "slider", tabindex: 0, "aria-label": `${name}; arrow keys move it forward, back, up and down`, "aria-valuemin": -300, "aria-valuemax": 500, "data-key": key },
        svg("circle", { class: "hit", r: 17 }), svg("circle", { class: "ring", r: 8 }));
      ring.addEventListener("pointerdown", event => { ring.setPointerCapture(event.pointerId); this.studio.hold(`${key}[0]`); });
      ring.addEventListener("pointermove", event => { if (ring.hasPointerCapture(event.pointerId)) this.drag(name, event); });
      ring.addEventListener("keydown", event => this.step(name, event));
      this.handles[name] = { key, fields, ring: this.rings.appendChild(ring) };
    }
    this.fields.prepend(dom("div", { class: "pair meaning", "aria-hidden": "true" }, dom("span", {}, "from the ankle"), dom("span", {}, "forward"), dom("span", {}, "up")));
  }

  place(name, x, z) {
    const { ring, fields } = this.handles[name], group = name.split(" ")[0];
    Object.assign(this.handles[name], { x, z });
    ring.setAttribute("transform", `translate(${x} ${-z})`);
    ring.setAttribute("aria-valuenow", Math.round(x));
    ring.setAttribute("aria-valuetext", `${number(x, 0)} mm forward, ${number(z, 0)} mm up`);
    [x, z].forEach((value, k) => fields[k].write(value));
    const from = this.handles[`${group} insertion`], to = this.handles[`${group} origin`];
    if (from?.x === undefined || to?.x === undefined) return;
    const share = Math.min(1, (this.links[group] ?? 0) / Math.hypot(to.x - from.x, to.z - from.z)), part = s => [from.x + s * (to.x - from.x), from.z + s * (to.z - from.z)];
    const [link, muscle, word] = this.muscles[group];
    word.setAttribute("x", to.x.toFixed(1));
    word.setAttribute("y", (-to.z - 16).toFixed(1));
    [link, muscle].forEach((line, k) => {
      const [[x1, z1], [x2, z2]] = k ? [part(share), part(1)] : [part(0), part(share)];
      for (const [attribute, value] of Object.entries({ x1, y1: -z1, x2, y2: -z2 })) line.setAttribute(attribute, value.toFixed(1));
    });
  }

  drag(name, event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.drawing.getScreenCTM().inverse());
    this.move(name, Math.round(point.x), Math.round(-point.y), event.timeStamp);
  }

  step(name, event) {
    const [right, up] = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0], step = event.shiftKey ? 5 : 1;
    if (!right && !up) return;
    event.preventDefault();
    this.move(name, this.handles[name].x + step * right, this.handles[name].z + step * up, event.timeStamp);
  }

  move(name, x, z, time) {
    const { key, fields } = this.handles[name];
    fields.forEach(field => field.good());
    this.place(name, x, z);
    this.studio.change({ [`${key}[0]`]: x, [`${key}[2]`]: z }, { time });
  }
}

/** The valves' times: bars over the gait cycle, or a timer's period [s], whose ends are dragged. A bar may run over heel strike. */
class Timing {
  constructor(box, studio) {
    Object.assign(this, { box, studio, rows: {}, length: 1 });
    this.word = value => (this.period ? `${value.toFixed(2)} s` : `${Math.round(100 * value)} %`);
  }

  write({ timing, period, idle }, toe_off, held) {
    this.idle = idle;
    if (Object.keys(timing).join() !== Object.keys(this.rows).join() || period !== this.period) {
      [this.period, this.length] = [period, period ?? 1];
      document.querySelector("#when").textContent = `When each valve is open, over the ${period ? "timer’s period" : "gait cycle"}. Drag an end, or move it with the arrow keys by 1 % of that, with Shift by 5 %.${period ? "" : " Swing is shaded."}`;
      this.rows = Object.fromEntries(Object.keys(timing).map(key => [key, this.row(key)]));
      this.box.replaceChildren(...Object.values(this.rows).map(row => row.element), dom("div", { class: "scale", "aria-hidden": "true" }, ...[0, 0.25, 0.5, 0.75, 1].map(share => dom("span", {}, this.word(share * this.length)))));
    }
    for (const [key, intervals] of Object.entries(timing)) {
      this.rows[key].swing.style.width = period ? 0 : `${100 * (1 - toe_off)}%`;
      if (!held(key)) this.draw(key, intervals.map(each => [...each]));
    }
  }

  row(key) {
    const [, chamber, side] = key.split("."), words = dom("span"), swing = dom("div", { class: "swing-part" }), problem = dom("p", { class: "problem", role: "alert", hidden: true });
    const track = dom("div", { class: "track" }, swing), name = `${chamber} ${side}`, tools = dom("span");
    return { name, words, swing, track, tools, problem, element: dom("div", { class: `bar-row ${side}`, "data-key": key }, dom("div", { class: "head-line" }, words, tools), track, problem) };
  }

  draw(key, intervals) {
    const row = this.rows[key], same = row.intervals?.length === intervals.length;
    row.intervals = intervals;
    if (!same) this.build(key);
    const why = this.idle[key];
    row.element.inert = Boolean(why);
    row.words.textContent = `${row.name}: ${why ? `${why}; ` : ""}${intervals.map(([a, b]) => `${this.word(a).split(" ")[0]}–${this.word(b)}`).join(", ") || "shut"}`;
    intervals.forEach((times, k) => {
      const [from, to] = times.map(value => value / this.length), bars = row.bars[k], parts = from <= to ? [[from, to], [0, 0]] : [[from, 1], [0, to]];
      parts.forEach(([a, b], n) => { bars.pieces[n].style.left = `${100 * a}%`; bars.pieces[n].style.width = `${100 * (b - a)}%`; });
      [from, to].forEach((value, end) => {
        const grip = bars.grips[end];
        grip.style.left = `${100 * value}%`;
        grip.setAttribute("aria-valuenow", Math.round(100 * value));
        grip.setAttribute("aria-valuetext", `${this.word(times[end])} of the ${this.period ? "timer’s period" : "gait cycle"}`);
      });
    });
  }

  build(key) {
    const row = this.rows[key], held = document.activeElement?.dataset?.grip;
    row.bars = row.intervals.map((_, k) => ({ pieces: [0, 1].map(() => dom("div", { class: "bar" })), grips: ["opens", "shuts"].map((word, end) => this.grip(key, k, end, `${row.name}, bar ${k + 1}, ${word}`)) }));
    row.track.replaceChildren(row.swing, ...row.bars.flatMap(bar => bar.pieces), ...row.bars.flatMap(bar => bar.grips));
    const change = intervals => { this.draw(key, intervals); this.studio.change({ [key]: intervals }, { fresh: true }); };
    row.tools.replaceChildren(
      dom("button", { type: "button", "aria-label": `${row.name}: add a bar`, onclick: () => change([...row.intervals, this.gap(row.intervals.map(each => each.map(value => value / this.length))).map(share => round(share * this.length))]) }, "+"), " ",
      dom("button", { type: "button", "aria-label": `${row.name}: remove the last bar`, disabled: !row.intervals.length, onclick: () => change(row.intervals.slice(0, -1)) }, "−"));
    if (held) this.box.querySelector(`[data-grip="${CSS.escape(held)}"]`)?.focus();
  }

  /** A tenth of the cycle that no bar fills, in hundredths; the last one where there is none. */
  gap(intervals) {
    const open = hundredth => intervals.some(([a, b]) => (a <= b ? a * 100 <= hundredth && hundredth <= b * 100 : a * 100 <= hundredth || hundredth <= b * 100));
    const from = Array.from({ length: 90 }, (_, k) => k).find(k => Array.from({ length: 13 }, (_, n) => k + n - 1).every(h => !open(h))) ?? 90;
    return [from / 100, (from + 10) / 100];
  }

  grip(key, k, end, label) {
    const grip = dom("div", { class: "grip", role: "slider", tabindex: 0, "aria-label": label, "aria-valuemin": 0, "aria-valuemax": 100, "data-grip": `${key} ${k} ${end}` });
    const move = (value, time) => {
      const row = this.rows[key], intervals = row.intervals.map(each => [...each]);
      intervals[k][end] = Math.min(this.length, Math.max(0, round(value)));
      if (intervals[k][0] === intervals[k][1] || intervals[k][end] === row.intervals[k][end]) return;
      this.draw(key, intervals);
      this.studio.change({ [key]: intervals }, { time });
    };
    grip.addEventListener("pointerdown", event => { grip.setPointerCapture(event.pointerId); grip.focus(); this.studio.hold(key); event.preventDefault(); });
    grip.addEventListener("pointermove", event => {
      const box = this.rows[key].track.getBoundingClientRect();
      if (grip.hasPointerCapture(event.pointerId)) move((event.clientX - box.left) / box.width * this.length, event.timeStamp);
    });
    grip.addEventListener("keydown", event => {
      const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (!by) return;
      event.preventDefault();
      move(this.rows[key].intervals[k][end] + by * Math.max(0.01, (event.shiftKey ? 0.05 : 0.01) * this.length), event.timeStamp);
    });
    return grip;
  }

  /** Say beside a row what is wrong with it, or that nothing is. */
  say(key, text) {
    const problem = this.rows[key].problem;
    problem.hidden = !text;
    problem.textContent = text;
  }
}

/** All of them, in their groups. */
export class Controls {
  constructor(studio) {
    Object.assign(this, { studio, rows: {} });
    this.side = new SideView(document.querySelector("#device .side"), document.querySelector("#anchors .rows"), studio);
    this.timing = new Timing(document.querySelector("#timing .bars"), studio);
    this.follow = document.querySelector("#follow");
  }

  /** Show a state; nothing is written into what somebody holds. */
  write(state, toe_off) {
    const held = key => this.studio.holds(key), listed = state.controls.map(control => control.key).join();
    if (listed !== this.listed) this.build(state.controls);
    this.listed = listed;
    for (const control of state.controls) this.rows[control.key].write(control, held(control.key));
    const links = Object.fromEntries(state.controls.filter(c => c.key.endsWith(".link_length")).map(c => [c.key.split(".")[2], c.value]));
    this.side.write(state.anchors, links, held);
    this.timing.write(state, toe_off, held);
    for (const group of GROUPS) {
      const box = document.getElementById(group), why = state.idle[group] ?? "";
      box.classList.toggle("idle", why !== "");
      box.querySelector(".why").textContent = why;
    }
  }

  build(controls) {
    this.rows = Object.fromEntries(controls.map(control => [control.key, new Row(control, this.studio)]));
    for (const group of GROUPS) {
      for (const more of [false, true]) {
        const box = document.querySelector(more ? `#${group} > .more:not(#trial, #anchors) > .rows` : `#${group} > .rows`);
        box?.replaceChildren(...controls.filter(c => c.group === group && c.more === more).map(c => this.rows[c.key].element));
      }
    }
  }

  /** The fields of a key; the last one of the two of an anchor where both were sent. */
  fields(keys) {
    const anchors = Object.values(this.side.handles).flatMap(({ key, fields }) => [[`${key}[0]`, fields[0]], [`${key}[2]`, fields[1]]]);
    const all = { ...Object.fromEntries(anchors), ...Object.fromEntries(Object.entries(this.rows).map(([key, row]) => [key, row.field])) };
    return keys.flatMap(key => all[key] ?? []);
  }

  /** Values of these keys were taken, or were not: `text` says why. */
  answer(keys, text) {
    for (const key of keys) if (text.startsWith(`${key} = `)) text = text.slice(key.length + 3); // it stands beside its field
    const fields = this.fields(keys);
    for (const field of fields) text ? field === fields.at(-1) && field.bad(text) : field.good();
    for (const key of keys) if (this.timing.rows[key]) this.timing.say(key, text);
    for (const key of keys) if (this.rows[key]?.select) text ? this.rows[key].select.setAttribute("aria-invalid", "true") : this.rows[key].select.removeAttribute("aria-invalid");
    return keys.some(key => this.timing.rows[key]) || fields.length > 0;
  }
}
