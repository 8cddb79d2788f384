// The page's side of the web socket: what is sent, what an answer changes, and when it is drawn.
import { Controls } from "./controls.js";
import { Plot, Walker, dom, sample, share } from "./figures.js";

const $ = id => document.getElementById(id);
const PATIENCE = 150; // until a computation is marked [ms]
const ENDED = 5000; // without a server [ms]
const JOINED = 1000; // between two key strokes of one step [ms]
const STILL = 400; // after the last change, until the walker walks on [ms]
const LATE = 5000; // after which a change counts as answered [ms]

const shown = { serial: -1, undo: 0, settled: null, before: null, reference: null, state: null, run: null, bands: {}, variants: [], kept: {}, fresh: { settled: true, run: true }, failed: false, trial: NaN, back: NaN };
window.studioLatency = [];

/** Sends changes: the newest value of each, one at a time, at most one a frame. */
const studio = {
  pending: null, // {sets, join, follow, time}: not sent yet
  waiting: null, // sent, not answered
  held: null, // key that the mouse holds
  last: { key: "", time: -STILL },

  change(sets, { fresh = false, follow = $("follow").checked, time = performance.now() } = {}) {
    const key = Object.keys(sets)[0], now = performance.now();
    const join = !fresh && this.last.key === key && (this.held === key || now - this.last.time < JOINED);
    this.last = { key, time: now };
    this.pending = { sets: { ...this.pending?.sets, ...sets }, join: join && (this.pending?.join ?? true), follow, time };
    requestAnimationFrame(() => this.flush());
  },
  flush(at_once = false) {
    if ((this.waiting && !at_once) || !this.pending || socket?.readyState !== WebSocket.OPEN) return;
    const { sets, join, follow } = this.pending, key = Object.keys(sets).join("\n");
    clearTimeout(this.waiting?.late);
    [this.waiting, this.pending] = [this.pending, null];
    this.waiting.late = setTimeout(() => this.answered(), LATE);
    send({ op: "change", sets, join, follow, key });
  },
  /** The newest change has its answer: it may be drawn, and the next one goes. */
  answered() {
    if (!this.waiting) return;
    clearTimeout(this.waiting.late);
    const { time } = this.waiting;
    this.waiting = null;
    requestAnimationFrame(() => this.flush());
    return time;
  },
  /** What was sent without an answer goes once more, before what was changed since: values are taken once. */
  again() {
    const { waiting, pending } = this;
    if (waiting) this.pending = { ...waiting, ...pending, sets: { ...waiting.sets, ...pending?.sets } };
    this.answered();
  },
  hold(key) {
    if (this.held !== key) this.last.key = "";
    this.held = key;
  },
  release() {
    if (!this.held) return;
    this.held = null;
    if (!this.waiting && !this.pending) writeState();
  },
  /** Whether somebody holds a key, or has changed it and has no answer yet; without a key, whether anything is held. */
  holds(key) {
    if (key === undefined) return this.held !== null;
    return this.held === key || [this.pending, this.waiting].some(change => change && key in change.sets);
  },
};

const controls = new Controls(studio);
const walkers = { without: new Walker($("without"), "without"), with: new Walker($("with"), "with") };
const plots = { ankle: new Plot("Ankle angle", "° (dorsiflexion +)", 1), toe: new Plot("Toe height", "mm", 0), torque: new Plot("Torque", "N·m (dorsiflexion +)", 1), pressure: new Plot("Pressure, gauge", "bar", 2) };
let socket = null, lost_at = null, phase = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;

// Answers --------------------------------------------------------------------------------------------------------

const answers = {
  document(message) {
    const newer = message.serial !== shown.serial;
    if (newer) {
      if (message.undo !== shown.undo && shown.settled) shown.before = shown.settled;
      Object.assign(shown, { serial: message.serial, fresh: { settled: false, run: false }, failed: false });
      $("verdict").setAttribute("aria-busy", "true");
      setTimeout(mark, PATIENCE);
      for (const id of ["wrong", "found", "open-report", "work", "unsettled"]) $(id).hidden = true;
      $("bands-lines").replaceChildren();
      shown.bands = {};
      $("saved").textContent = "";
      if (!studio.waiting) studio.last.key = "";
      if (message.serial === shown.trial + 1) shown.back = message.undo;
      $("trial-back").hidden = message.undo !== shown.back;
    } else if (studio.waiting) taken();
    shown.undo = message.undo;
    $("undo").disabled = !message.undo;
    $("redo").disabled = !message.redo;
    if (message.folder !== shown.folder) $("folder").value = message.folder; // what is typed there stays
    shown.folder = message.folder;
    shown.variants = message.variants;
    shown.kept = Object.fromEntries(Object.entries(shown.kept).filter(([slot]) => message.variants.some(one => one.slot === slot)));
    offerVariants();
    if (!newer) draw();
  },
  settled(message) {
    shown.settled = message;
    shown.fresh.settled = true;
    const time = taken();
    draw();
    glance();
    mark();
    if (time !== undefined) requestAnimationFrame(() => {
      performance.mark("studio-drawn");
      window.studioLatency.push(performance.now() - time);
    });
  },
  unsettled(message) {
    say("unsettled", message.text);
    taken();
  },
  variant(message) {
    shown.kept[message.slot] = message;
    draw();
  },
  reference(message) {
    const same = JSON.stringify(shown.reference?.curves) === JSON.stringify(message.curves);
    shown.reference = message;
    if (!same) draw();
  },
  state(message) {
    const first = !shown.state;
    shown.state = message;
    $("title").textContent = $("title").title = message.title;
    $("clearance").textContent = `Toe clearance: ${message.clearance}.`;
    writeState();
    if (first) draw();
  },
  run(message) {
    shown.fresh.run = true;
    shown.run = message;
    mark();
    $("verdict").setAttribute("aria-busy", "false");
    $("lead").textContent = message.lead;
    $("no-device").textContent = message.device.join(" ");
    $("whom").textContent = message.whom;
    $("mind").hidden = false;
    const told = ([head, rest]) => dom("li", {}, dom("strong", {}, head), rest);
    $("notes").replaceChildren(...message.notes.map(told));
    $("warnings").replaceChildren(...message.warnings.map(told));
    glance();
    const open = new Set([...$("answers").querySelectorAll("details[open]")].map(each => each.dataset.name));
    $("answers").replaceChildren(...message.verdict.map(answer => dom("div", { class: `answer ${answer.status}` },
      dom("p", {}, dom("strong", {}, answer.mark), " ", dom("b", {}, answer.question)), dom("p", {}, answer.brief || answer.text),
      dom("details", { "data-name": answer.name, open: open.has(answer.name) }, dom("summary", { "aria-label": `In full: ${answer.question}` }, "in full"), dom("p", {}, answer.text), dom("p", {}, answer.limit ? `Limit: ${answer.limit}` : "")))));
  },
  effects(message) {
    $("effects-lead").textContent = message.lines.join(" ");
    $("effects").replaceChildren(...message.steps.map(step => dom("button", { type: "button", onclick: () => take(step.sets) }, step.text)));
  },
  bands(message) {
    done();
    $("bands-lines").replaceChildren(...message.lines.map(text => dom("li", {}, text)));
    shown.bands = message.curves;
    draw();
  },
  progress(message) {
    working(message.what, message.share);
  },
  found(message) {
    done();
    $("found").hidden = false;
    $("found").firstChild.textContent = message.text;
    const label = key => shown.state.controls.find(control => control.key === key)?.label ?? key;
    $("found").querySelector("ul").replaceChildren(...Object.entries(message.sets).map(([key, value]) => dom("li", {}, `${label(key)}: ${value}`)));
    $("found").lastChild.onclick = () => take(message.sets);
  },
  report(message) {
    const wanted = !$("work").hidden; // not when it is heard again after a reload
    done();
    $("open-report").hidden = false;
    if (wanted) window.open(message.file, "_blank", "noopener");
  },
  saved(message) {
    $("saved").textContent = `Saved. Run it with: afo-sim run ${/\s/.test(message.folder) ? `"${message.folder}"` : message.folder}`;
    $("folder").value = message.folder;
  },
  problem(message) {
    const keys = message.key ? message.key.split("\n") : [], own = keys.length && studio.waiting && Object.keys(studio.waiting.sets).join("\n") === message.key;
    if (message.key === "import") return say("trial-problem", message.text), reading(false);
    if (message.key === "rename") offerVariants(true);
    if (own) studio.last.key = "";
    studio.answered();
    if (keys.length && controls.answer(keys, message.text)) return writeState();
    done();
    if (!keys.length && message.serial === shown.serial) {
      shown.failed = true;
      mark();
      $("verdict").setAttribute("aria-busy", "false");
    }
    say("wrong", shown.fresh.settled ? message.text : `${message.text} The curves are those of the design before.`);
  },
  trial(message) {
    say("trial-problem", "");
    reading(false);
    shown.trial = message.serial ?? NaN;
    if (shown.serial === shown.trial + 1) shown.back = shown.undo;
    $("trial-back").hidden = shown.undo !== shown.back;
    $("trial").open = true;
    $("imported").hidden = false;
    $("trial-text").textContent = message.text;
    $("trial-picture").src = $("trial-large").href = `${message.picture}?${Date.now()}`;
    const row = (cells, head) => dom("tr", {}, ...cells.map((cell, k) => dom(k || !head ? "td" : "th", k || !head ? {} : { scope: "row" }, String(cell))));
    $("trial-rows").tBodies[0].replaceChildren(...message.rows.map(cells => row(cells, true)));
    $("trial-checks").tBodies[0].replaceChildren(...message.checks.map(cells => row(cells, true)));
    $("trial-warnings").replaceChildren(...message.warnings.map(text => dom("li", {}, text)));
  },
};

/** The change that waits was taken: its fields are good again. */
function taken() {
  if (studio.waiting) controls.answer(Object.keys(studio.waiting.sets), "");
  return studio.answered();
}

const OF_ANY_DESIGN = new Set(["document", "saved", "problem", "trial", "variant"]);

function hear(event) {
  const message = JSON.parse(event.data);
  if (OF_ANY_DESIGN.has(message.kind) || message.serial === shown.serial) answers[message.kind]?.(message);
  if (message.kind !== "progress") compare();
}

// Drawing --------------------------------------------------------------------------------------------------------

function writeState() {
  if (!shown.state) return;
  controls.write(shown.state, shown.settled?.toe_off ?? 0.6);
  offer();
}

/** On a small screen, below all: the answer, while something else is in view. */
function glance() {
  const marks = shown.fresh.run ? shown.run.verdict.map(answer => answer.mark[0]).join(" ") : "…";
  $("glance").textContent = `Toe ${shown.settled?.lowest ?? "…"}  ${marks}`;
}

/** Mark what is still computed. */
function mark() {
  const { settled, run } = shown.fresh, { failed } = shown, put = (id, text) => { if ($(id).textContent !== text) $(id).textContent = text; };
  document.body.classList.toggle("computing", !settled);
  $("verdict").classList.toggle("judging", !run);
  put("computing", settled ? "" : failed ? "not computed" : "computing the curves …");
  put("judging", run ? "" : failed ? "not computed" : "computing …");
  if (!run) put("effects-lead", "It is computed when the design rests.");
  if (!run) $("effects").replaceChildren();
}

function draw() {
  const { settled, before, reference, state } = shown;
  if (!settled) return;
  const toe_off = settled.toe_off, name = "with";
  const kept = of => shown.variants.flatMap(({ slot, name }) => of(shown.kept[slot]?.curves ?? {}).map((values, k) => ({ name: k ? "" : name, style: `variant ${slot} ${k ? "thin" : ""}`, values })));
  const lines = key => [{ name, style: "with", values: settled.curves[key] }, { name: "without", style: "without", values: reference?.curves[key] }, ...kept(curves => [curves[key]]), { name: "before", style: "before", values: before?.curves[key] }];
  const drawn = key => ({ name: "5 to 95 % of what is not known", style: "band drawn", ...shown.bands[key] });
  plots.ankle.draw([...lines("ankle"), { name: "recorded walk", style: "recorded", values: settled.curves.recorded }], { toe_off, bands: [{ name: "norm", style: "band", ...state?.norm }, drawn("ankle")] });
  plots.toe.draw(lines("toe"), { toe_off, floor: true, bands: [drawn("toe")] });
  plots.torque.draw(lines("torque").filter(line => line.name !== "without"), { toe_off });
  const chambers = Object.entries(settled.curves.pressure).map(([chamber, values], k) => ({ name: chamber, style: k ? "second" : "with", values }));
  const former = Object.entries(before?.curves.pressure ?? {}).map(([, values], k) => ({ name: "before", style: "before", values: k ? null : values }));
  plots.pressure.draw([...chambers, ...kept(curves => Object.values(curves.pressure ?? {})), ...former], { toe_off });
  if (!controls.side.outlined) controls.side.outline(settled.poses);
  controls.side.outlined = true;
  $("without").hidden = !reference;
  document.querySelector(".walkers").classList.toggle("one", !reference);
  document.querySelector(".with-what").textContent = { shoe: "(in the shoe)", barefoot: "(barefoot)", "orthosis-off": "(worn, without air)" }[reference?.compared_with] ?? "";
  point();
}

/** Buttons that keep the design and go back to a variant, and their names; what somebody types stays. */
function offerVariants(anew = false) {
  const { variants } = shown, listed = JSON.stringify(variants), held = document.activeElement, within = held?.closest("#variants, #compare thead");
  $("compare").hidden = !variants.length;
  $("keep").disabled = variants.length === 3 || variants.some(one => one.shown);
  $("keep").textContent = variants.length === 3 ? "Three variants are kept" : "Keep as a variant";
  if (listed === shown.listed && !anew) return;
  shown.listed = listed;
  $("variants").replaceChildren(...variants.map(({ slot, name, shown: on }) => dom("button", { type: "button", id: `show-${slot}`, class: on && "shown", "aria-pressed": String(on), "aria-label": `Go back to ${name}`, title: "Go back to this variant", onclick: () => act("show", { slot }) }, sample(`variant ${slot}`), name)));
  document.querySelector("#compare thead tr").replaceChildren(dom("td"), dom("th", { scope: "col" }, sample("with"), "Present design"), ...variants.map(({ slot, name }) => dom("th", { scope: "col", abbr: name }, sample(`variant ${slot}`),
    dom("input", { id: `name-${slot}`, value: name, maxlength: 40, "aria-label": `Name of variant ${name}`, autocomplete: "off", onchange: event => act("rename", { slot, name: event.target.value, key: "rename" }) }),
    dom("button", { type: "button", id: `remove-${slot}`, "aria-label": `Remove ${name}`, onclick: () => act("remove", { slot }) }, "Remove"))));
  const again = within && ($(held.id) ?? document.querySelector("#compare thead button") ?? $("keep"));
  if (again && held.value && !anew) again.value = held.value;
  again?.focus();
}

/** The table of the variants beside the present design: results, and the keys that differ; below a part that is another one only what was set. */
function compare() {
  if (!shown.variants.length) return;
  const { variants, kept, state, run, fresh } = shown, all = [{ values: state?.serial === shown.serial && state.values, results: fresh.run ? run?.results : null }, ...variants.map(({ slot }) => kept[slot] ?? {})];
  const told = all.filter(each => each.values), keys = [...new Set(told.flatMap(each => Object.keys(each.values)))], value = (each, key) => each.values?.[key]?.[1] ?? "";
  const differing = keys.filter(key => new Set(told.map(each => value(each, key))).size > 1), above = key => differing.some(other => key.startsWith(`${other}.`));
  const row = (label, cells, title) => dom("tr", {}, dom("th", { scope: "row", title }, label), ...cells.map(([text, status]) => dom("td", { class: status || false }, text)));
  const labels = [...new Set(all.flatMap(each => (each.results ?? []).map(([label]) => label)))], waits = (each, n) => [each.problem ? (n ? "–" : each.problem) : shown.failed && each === all[0] ? "not computed" : "computing …"];
  document.querySelector("#compare tbody").replaceChildren(
    ...labels.map((label, n) => row(label, all.map(each => each.results ? (each.results.find(one => one[0] === label)?.slice(1) ?? ["–"]) : waits(each, n)))),
    ...differing.filter(key => !above(key) || told.some(each => each.values[key]?.[2])).map(key => row(told.map(each => each.values[key]?.[0]).find(Boolean), all.map(each => each.values ? [value(each, key) || "–"] : waits(each)), key)));
}

function point() {
  if (!shown.settled) return;
  walkers.with.draw(shown.settled, phase);
  if (shown.reference) walkers.without.draw(shown.reference, phase);
  for (const plot of Object.values(plots)) plot.point(phase);
  $("phase").value = Math.round(100 * phase);
  const words = `${Math.round(100 * phase)} %, ${phase < shown.settled.toe_off ? "stance" : "swing"}`;
  $("phase-text").textContent = words;
  if (!playing) $("phase").setAttribute("aria-valuetext", words);
}

let drawn = 0;
/** Walk on; while somebody changes the design the walker stands still, which shows the change and leaves the time to the answer. */
function frame(now) {
  const still = studio.waiting || studio.holds() || now - studio.last.time < STILL;
  if (playing && shown.settled && !still && now - drawn > 38) {
    phase = (phase + Math.min(now - drawn, 100) / 1000 * $("speed").value / shown.settled.stride_time) % 1;
    drawn = now;
    point();
  }
  requestAnimationFrame(frame);
}

function play(on) {
  playing = on;
  $("play").textContent = on ? "Pause" : "Play";
}

// Work and messages ----------------------------------------------------------------------------------------------

function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

/** Without a connection nothing can be asked for: the server says again what can when it is back. */
function away(on) {
  for (const each of document.querySelectorAll("header button, #compare :is(input, button), #save button, #bands, #report, #search, #stop, #import, #trial-back")) each.disabled = on;
}

/** What is asked for, after the changes that are under way. */
function act(op, more = {}) {
  studio.flush(true);
  studio.last.key = "";
  say("wrong", "");
  send({ op, ...more });
}

/** Try values that the server has offered; links are among them. */
function take(sets) {
  studio.change(sets, { fresh: true, follow: false });
}

function say(id, text) {
  $(id).hidden = !text;
  $(id).textContent = text;
}

function working(what, part) {
  $("work").hidden = false;
  $("work-what").textContent = what;
  $("progress").value = part;
}

function done() {
  $("work").hidden = true;
}

/** What the search may vary, with its limits, from the state. */
function offer() {
  const { controls: all, timing } = shown.state, range = (ending, limits) => Object.fromEntries(all.filter(c => c.key.endsWith(ending) && typeof c.value === "number").map(c => [c.key, limits(c)]));
  const round = value => Math.round(100 * value) / 100, length = shown.state.period ?? 1, near = value => [round(Math.max(0, value - 0.1 * length)), round(Math.min(length, value + 0.1 * length))];
  const times = Object.entries(timing).flatMap(([key, all]) => all.flatMap((each, k) => each.map((value, end) => [`${key}[${k}][${end}]`, near(value)]))).filter(([, [low, high]]) => low > 0 && high < length);
  const offers = { pressure: range("supply.pressure", c => [c.low, c.high]), "length of the links": range(".link_length", c => [Math.max(1, c.value - 20), c.value + 20]),
    timing: Object.fromEntries(times), "number of muscles": range(".count", c => [c.low, c.high]) };
  const words = { pressure: c => Object.values(c).map(([low, high]) => `${low} to ${high} bar`).join(), "length of the links": () => "20 mm up and down", timing: () => "each time by a tenth of the cycle", "number of muscles": c => Object.values(c)[0]?.join(" to ") };
  const chosen = new Set([...$("vary").querySelectorAll("input:checked")].map(box => box.value));
  if (!$("vary").children.length) $("vary").replaceChildren(...Object.entries(offers).filter(([, keys]) => Object.keys(keys).length).map(([name, keys], k) =>
    dom("label", {}, dom("input", { type: "checkbox", value: name, checked: chosen.size ? chosen.has(name) : k === 0 }), ` ${name} `, dom("small", {}, `(${words[name](keys)})`))));
  $("search").keys = () => Object.assign({}, ...[...$("vary").querySelectorAll("input:checked")].map(box => offers[box.value]));
}

function reading(on) {
  $("import").disabled = on;
  $("import").textContent = on ? "Reading …" : "Read this walk";
}

const files = [];
function bring(list) {
  for (const file of list) if (!files.some(each => each.name === file.name)) files.push(file);
  $("dropped").replaceChildren(...files.map(file => dom("li", {}, file.name)));
  say("trial-problem", "");
}

async function read() {
  const walker = document.querySelector("[name=walker]:checked")?.value;
  if (!files.length) return say("trial-problem", "Choose the files of a trial first.");
  if (!walker) return say("trial-problem", "Choose first whose walk the files show.");
  say("trial-problem", "");
  reading(true);
  const failed = text => { say("trial-problem", text); reading(false); };
  try {
    for (const file of files) {
      const answer = await fetch(`files/${encodeURIComponent(file.name)}`, { method: "PUT", body: file });
      const said = await answer.json();
      if (said.problem) return failed(said.problem);
    }
  } catch { return failed("The files did not reach the studio."); }
  act("import", { files: files.map(file => file.name), walker, side: $("side").value, key: "import" });
  files.length = 0;
  $("dropped").replaceChildren();
}

// The socket -----------------------------------------------------------------------------------------------------

function connect() {
  socket = new WebSocket(new URL("socket", location.href.replace("http", "ws")));
  socket.onmessage = hear;
  socket.onopen = () => {
    lost_at = null;
    shown.serial = -1;
    shown.kept = {};
    away(false);
    reading(false);
    say("lost", "");
    studio.flush();
  };
  socket.onclose = () => {
    lost_at ??= Date.now();
    studio.again();
    away(true);
    say("lost", Date.now() - lost_at < ENDED ? "The connection to the studio is lost: the page tries again every second, and then sends what you change meanwhile."
      : "The studio has ended. Start it again with: afo-sim studio");
    setTimeout(connect, 1000);
  };
}

// Wiring ---------------------------------------------------------------------------------------------------------

$("plots").append(...Object.values(plots).map(plot => plot.figure));
for (const plot of Object.values(plots)) {
  const scrub = event => { if (event.buttons) { play(false); phase = share(event); point(); } };
  plot.drawing.addEventListener("pointerdown", scrub);
  plot.drawing.addEventListener("pointermove", scrub);
}
$("keep").onclick = () => act("keep");
const back = op => () => {
  for (const key of [...Object.keys(controls.rows), ...Object.keys(controls.timing.rows)]) controls.answer([key], "");
  for (const { key } of Object.values(controls.side.handles)) controls.answer([`${key}[0]`, `${key}[2]`], "");
  act(op);
};
$("undo").onclick = back("undo");
$("redo").onclick = back("redo");
$("play").onclick = () => play(!playing);
$("phase").oninput = () => { play(false); phase = Math.min($("phase").value / 100, 0.99999); point(); };
for (const id of ["bands", "report"]) $(id).onclick = () => { working(id === "bands" ? "computing bands" : "making the report", 0); act(id); };
$("search").onclick = () => {
  const keys = $("search").keys?.() ?? {};
  if (!Object.keys(keys).length) return say("wrong", "Choose at least one thing that may vary.");
  working("searching", 0);
  act("search", { keys, objective: "air_per_stride" });
};
$("stop").onclick = () => { done(); act("stop"); };
$("save").onsubmit = event => { event.preventDefault(); act("save", { folder: $("folder").value }); };
$("files").onchange = () => { bring($("files").files); $("files").value = ""; };
addEventListener("dragover", event => { event.preventDefault(); $("drop").classList.add("over"); });
addEventListener("dragleave", () => $("drop").classList.remove("over"));
addEventListener("drop", event => { // anywhere on the page
  event.preventDefault();
  $("drop").classList.remove("over");
  if (!event.dataTransfer.files.length) return;
  $("patient").open = $("trial").open = true;
  bring(event.dataTransfer.files);
});
$("import").onclick = read;
$("trial-back").onclick = () => { $("imported").hidden = true; act("undo"); };
addEventListener("beforeprint", () => { // as the report stands: where the toe is lowest in swing
  const { curves: { toe }, toe_off } = shown.settled ?? { curves: { toe: [] }, toe_off: 1 }, swing = Math.ceil((toe_off + 0.1) * 100);
  if (toe.length) { play(false); phase = (swing + toe.slice(swing, 95).reduce((best, height, k, all) => (height < all[best] ? k : best), 0)) / 100; point(); }
});
addEventListener("pointerup", () => studio.release());
addEventListener("pointercancel", () => studio.release());
addEventListener("keydown", event => {
  const typing = document.activeElement?.matches("input:not([type=range], [type=checkbox], [type=radio])");
  if (event.key.toLowerCase() !== "z" || !(event.ctrlKey || event.metaKey) || (typing && document.activeElement.value !== document.activeElement.defaultValue && controls.fields(Object.keys(controls.rows)).some(f => f.dirty && f.input === document.activeElement))) return;
  event.preventDefault();
  $(event.shiftKey ? "redo" : "undo").click();
});
if (innerWidth < 896) for (const group of document.querySelectorAll(".group")) group.open = group.id === "air";
play(playing);
connect();
requestAnimationFrame(frame);
