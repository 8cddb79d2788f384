// What is drawn: the walkers, the curves over the gait cycle. Lengths of poses are in metres, z up from the floor.

const SVG = "http://www.w3.org/2000/svg";

/** An element of the page, with attributes and children; a text is a text, whatever it holds. */
export function dom(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

/** An element of a drawing. */
export function svg(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

export const number = (value, digits) => (Number(value.toFixed(digits)) + 0).toFixed(digits).replace("-", "−"); // no "−0"
const path = points => points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(4)} ${y.toFixed(4)}`).join("");

/** The value of 101 equally spaced ones at a share of the cycle. */
export function at(values, phase) {
  const place = phase * (values.length - 1), k = Math.min(Math.floor(place), values.length - 2);
  return values[k] + (place - k) * (values[k + 1] - values[k]);
}

const mixed = (a, b, share) => a.map((value, k) => value + share * (b[k] - value));

/** Points of a pose between two frames, the hip at x = 0. */
function posed(poses, phase) {
  const last = poses.hip.length - 1, place = phase * last, k = Math.min(Math.floor(place), last - 1), share = place - k;
  const hip = mixed(poses.hip[k], poses.hip[k + 1], share)[0];
  const point = frames => { const [x, z] = mixed(frames[k], frames[k + 1], share); return [x - hip, z]; };
  const line = frames => frames[k].map((_, n) => { const [x, z] = mixed(frames[k][n], frames[k + 1][n], share); return [x - hip, z]; });
  const found = { x: hip, muscles: poses.muscles.map(line), sole: line(poses.sole), other_sole: line(poses.other_sole) };
  for (const name of ["neck", "head", "hip", "knee", "ankle", "other_knee", "other_ankle"]) found[name] = point(poses[name]);
  return found;
}

/** A walker from the side, and the foot enlarged beside it. */
export class Walker {
  constructor(figure, name) {
    this.figure = figure;
    [this.toe, this.lowest] = figure.querySelectorAll(".toe, .lowest");
    this.parts = {};
    const part = (key, style) => (this.parts[key] = svg("path", { class: style }));
    this.body = svg("g", { id: `walker-${name}`, transform: "scale(1 -1)" },
      part("ground", "ground"), part("other", "far"), part("other_foot", "far foot"), part("leg", "near"), part("foot", "near foot"),
      (this.head = svg("circle", { class: "near head", r: 0.085 })), (this.muscles = svg("g")), part("drop", "drop-line"));
    this.lens = svg("svg", { x: 168, y: 96, width: 122, height: 122 }, svg("use", { href: `#walker-${name}` }));
    this.whole = svg("svg", { x: 0, y: 0, width: 168, height: 222 }, this.body);
    this.drawing = svg("svg", { viewBox: "0 0 294 222", role: "img", "aria-label": `Walker from the side, ${name} the device, and the foot enlarged` },
      this.whole, this.lens, svg("rect", { class: "lens", x: 168, y: 96, width: 122, height: 122 }));
    figure.prepend(this.drawing);
  }

  /** Draw a message's stride at a share of its cycle, and state the toe's height in words. */
  draw(message, phase) {
    const pose = posed(message.poses, phase), set = (key, d) => this.parts[key].setAttribute("d", d);
    const foot = (ankle, sole) => `${path([ankle, ...sole])}Z`;
    set("leg", path([pose.neck, pose.hip, pose.knee, pose.ankle]));
    set("other", path([pose.hip, pose.other_knee, pose.other_ankle]));
    set("foot", foot(pose.ankle, pose.sole));
    set("other_foot", foot(pose.other_ankle, pose.other_sole));
    this.head.setAttribute("cx", pose.head[0]);
    this.head.setAttribute("cy", pose.head[1]);
    const first = 0.25 - (pose.x % 0.25) - 1.0;
    set("ground", "M-1 0H1.5" + Array.from({ length: 10 }, (_, k) => `M${(first + 0.25 * k).toFixed(3)} 0l-0.03 -0.05`).join(""));
    while (this.muscles.children.length < pose.muscles.length) this.muscles.append(svg("path", { class: "muscle" }));
    [...this.muscles.children].forEach((each, k) => each.setAttribute("d", pose.muscles[k] ? path(pose.muscles[k]) : ""));
    const height = at(message.curves.toe, phase), swing = phase > message.toe_off, below = swing && height < 0;
    if (message !== this.message) { // the head stays inside
      const top = Math.max(...message.poses.head.map(([, z]) => z)) + 0.12;
      this.whole.setAttribute("viewBox", `${(-0.36 * top).toFixed(3)} ${-top.toFixed(3)} ${(0.79 * (top + 0.08)).toFixed(3)} ${(top + 0.08).toFixed(3)}`);
    }
    this.message = message;
    const [x] = pose.sole[2];
    set("drop", swing ? `M${x.toFixed(4)} 0V${(height / 1000).toFixed(4)}` : "");
    this.lens.setAttribute("viewBox", `${(pose.ankle[0] - 0.12).toFixed(4)} -0.32 0.38 0.38`);
    this.parts.drop.classList.toggle("below", below);
    this.toe.classList.toggle("below", below);
    this.toe.textContent = swing ? `toe ${number(Math.abs(height), 0)} mm ${below ? "below" : "above"} the floor` : "stance";
    this.lowest.textContent = `lowest in swing: ${message.lowest}`;
  }
}

const LEFT = 36, RIGHT = 288, TOP = 6, BOTTOM = 118;
const across = share => LEFT + share * (RIGHT - LEFT);

/** Round steps from the lowest to the highest value. */
function ticks(low, high) {
  const raw = (high - low) / 4, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find(each => each * power >= raw);
  const from = Math.floor(low / step), to = Math.ceil(high / step);
  return Array.from({ length: to - from + 1 }, (_, k) => (from + k) * step);
}

/** A curve over the gait cycle, with the words of its lines above it. */
export class Plot {
  constructor(title, unit, digits) {
    Object.assign(this, { title, unit, digits });
    this.now = dom("span", { class: "now" });
    this.keys = dom("ul", { class: "keys" });
    this.drawing = svg("svg", { viewBox: "0 0 304 148", role: "img" });
    this.figure = dom("figure", {}, dom("figcaption", {}, dom("strong", {}, title, ", ", unit, this.now), this.keys), this.drawing);
    this.cursor = svg("line", { class: "cursor", y1: TOP, y2: BOTTOM });
  }

  /** lines: [{name, style, values}], the first one is read at the cursor, one without a name has no words; bands: [{name, style, low, high}]. */
  draw(lines, { toe_off, bands = [], floor = false }) {
    const shown = lines.filter(line => line.values), seen = bands.filter(band => band.low), all = [...shown.map(line => line.values), ...seen.flatMap(band => [band.low, band.high])].flatMap(values => floor ? values.slice(Math.round(toe_off * (values.length - 1))) : values).concat(floor || !seen.length ? [0] : []);
    const marks = ticks(Math.min(...all), Math.max(...all, Math.min(...all) + 0.1)), low = marks[0], high = marks.at(-1);
    const up = value => BOTTOM - (value - low) / (high - low) * (BOTTOM - TOP);
    const line = values => path(values.map((value, k) => [across(k / (values.length - 1)), up(value)]));
    this.first = shown[0]?.values;
    const parts = [svg("rect", { class: "swing", x: across(toe_off), y: TOP, width: across(1) - across(toe_off), height: BOTTOM - TOP })];
    if (floor && low < 0) parts.push(svg("rect", { class: "sunk", x: across(toe_off), y: up(0), width: across(1) - across(toe_off), height: BOTTOM - up(0) }));
    const box = { x: LEFT, y: TOP, width: RIGHT - LEFT, height: BOTTOM - TOP }, inside = (...each) => parts.push(svg("svg", { ...box, viewBox: Object.values(box).join(" ") }, ...each));
    inside(...seen.map(band => svg("path", { class: band.style, d: `${line(band.low)}${line(band.high).replaceAll("M", "L").split("L").slice(1).reverse().map(p => `L${p}`).join("")}Z` })));
    for (const mark of marks) parts.push(svg("line", { class: mark === 0 ? "axis" : "grid", x1: LEFT, x2: RIGHT, y1: up(mark), y2: up(mark) }),
      svg("text", { x: LEFT - 4, y: up(mark) + 4, "text-anchor": "end" }, number(mark, marks[1] - marks[0] < 1 ? 1 : 0)));
    for (const share of [0, 0.25, 0.5, 0.75, 1]) parts.push(svg("text", { x: across(share), y: BOTTOM + 14, "text-anchor": "middle" }, `${100 * share}`));
    parts.push(svg("text", { x: LEFT, y: BOTTOM + 27 }, "gait cycle, %"), svg("line", { class: "off", x1: across(toe_off), x2: across(toe_off), y1: TOP, y2: BOTTOM }),
      svg("text", { x: across(toe_off), y: BOTTOM + 27, "text-anchor": "middle" }, "toe-off"), svg("line", { class: "axis", x1: LEFT, x2: LEFT, y1: TOP, y2: BOTTOM }));
    inside(...[...shown].reverse().map(each => svg("path", { class: `curve ${each.style}`, d: line(each.values) })));
    this.drawing.replaceChildren(...parts, this.cursor);
    this.drawing.setAttribute("aria-label", `${this.title} over the gait cycle, ${this.unit}: ` +
      shown.filter(each => each.name).map(each => `${each.name} from ${number(Math.min(...each.values), this.digits)} to ${number(Math.max(...each.values), this.digits)}`)
        .concat(seen.map(band => `band of ${band.name} from ${number(Math.min(...band.low), this.digits)} to ${number(Math.max(...band.high), this.digits)}`)).join("; "));
    const words = JSON.stringify([...shown, ...seen].filter(each => each.name).map(each => [each.name, each.style]));
    if (words !== this.words) this.keys.replaceChildren(...JSON.parse(words).map(([name, style]) => dom("li", {}, sample(style), name)));
    this.words = words;
  }

  /** Move the cursor. */
  point(phase) {
    const x = across(phase).toFixed(2);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    this.now.textContent = this.first ? `${number(at(this.first, phase), this.digits)} ${this.unit.split(" (")[0]}` : "";
  }
}

export function sample(style) {
  const mark = style.startsWith("band") ? svg("rect", { class: style, width: 28, height: 11 }) : svg("path", { class: `curve ${style}`, d: "M0 6H28" });
  return svg("svg", { viewBox: "0 0 28 12", "aria-hidden": "true" }, mark);
}

/** The share of the cycle at a place of the mouse over a plot. */
export function share(event) {
  const box = event.currentTarget.getBoundingClientRect();
  return Math.min(1, Math.max(0, ((event.clientX - box.left) / box.width * 304 - LEFT) / (RIGHT - LEFT)));
}
