// The site's search, in place of Zensical's worker, which wants every word of a question; it answers the same
// messages. Sections are ranked by BM25F (Robertson & Zaragoza 2009), and with a share of what their whole page
// has: a page that answers speaks of all the words, if not in one section.
"use strict";
const WEIGHT = { title: 4, path: 2, text: 1 }; // of a word in each field
const FLAT = { title: 0.3, path: 0.3, text: 0.7 }; // how far a long field counts less
const SATURATION = 2, PAGE = 1, AGAIN = 0.5; // of a page that has been listed
const LISTED = 0.6; // of the first page and the reference: they answer less than what they lead to
const NAME = /--\w|\w[_./]\w/; // of code: who asks for one looks it up in a list
const MOST = 30, LEAST = 0.1; // hits, and score of the last by that of the first
const STEMS = [
  [/(ss|us|is)$/, "$1"], [/ies$/, "y"], [/(sh|ch|x|z|ss)es$/, "$1"], [/s$/, ""], [/([^aeiou])\1(ing|ed)$/, "$1"],
  [/(?<=..[aeiouy].*|[aeiou]..)(ing|ed)$/, ""], [/(?<=....)(ness|ity|ly|ment)$/, ""],
  [/(?<=....)at(e|ion|or)$/, ""], [/(?<=...)e$/, ""],
];
// What people of other trades, or at their first visit, call things here.
const SAME = [
  "orthosis afo brace splint exoskeleton", "muscle actuator", "outsole sole insole", "shoe footwear boot",
  "uncertainty confidence interval band certain", "trial capture mocap recording gait", "tube hose pipe",
  "buy choose pick smallest", "learn train agent policy", "validation published literature evidence",
  "first start begin beginner tutorial", "stiffness compliance elastic", "weak paralysis paresis",
  "bottle cylinder cartridge tank", "valve solenoid", "film movie video animation", "simulate model",
  "figure plot picture graph chart", "csv excel spreadsheet", "speed fast slow performance", "step stride",
  "error fail crash problem", "network internet online", "mass weight heavy", "board microcontroller arduino",
];
let same, sections, pages, index, separator;

const plain = text => text.normalize("NFKD").replace(/\p{M}/gu, "").toLowerCase();
const stem = word => STEMS.reduce((rest, [end, instead]) => rest.replace(end, instead), word);

function words(text) { // of a field with their places, without tags and entities
  const found = [...text.matchAll(/<[^>]*>|&#?\w+;|[\p{L}\p{N}]+/gu)].filter(([word]) => !/^[<&]/.test(word));
  return found.map(({ 0: word, index }) => ({ stem: stem(plain(word)), start: index, end: index + word.length }));
}

class Ranked { // texts of {field: words}
  constructor(texts) {
    this.count = texts.length;
    this.having = new Map(); // stem: text: weighted count
    for (const field in WEIGHT) {
      const mean = texts.reduce((sum, text) => sum + text[field].length, 0) / texts.length || 1;
      texts.forEach((text, k) => {
        const flat = 1 - FLAT[field] + FLAT[field] * text[field].length / mean;
        for (const { stem } of text[field]) {
          if (!this.having.has(stem)) this.having.set(stem, new Map());
          const counts = this.having.get(stem);
          counts.set(k, (counts.get(k) ?? 0) + WEIGHT[field] / flat);
        }
      });
    }
  }
  scores(asked) { // of each text, by words, each {stem: worth} of all that it may stand for
    const scores = new Float64Array(this.count);
    for (const meant of asked) {
      const counts = new Map(), worths = new Map();
      for (const [stem, worth] of meant)
        for (const [k, count] of this.having.get(stem) ?? []) {
          counts.set(k, (counts.get(k) ?? 0) + worth * count);
          worths.set(k, Math.max(worths.get(k) ?? 0, worth));
        }
      const common = [...worths.values()].reduce((sum, worth) => sum + worth, 0.5);
      const rarity = Math.log(1 + (this.count + 1 - common) / common);
      for (const [k, count] of counts) scores[k] += rarity * count / (SATURATION + count);
    }
    return scores;
  }
}

function mistypings(one, other) { // letters to change, add or leave out
  if (Math.abs(one.length - other.length) > 2) return 3;
  let row = [...other, ""].map((_, j) => j);
  for (let i = 0; i < one.length; i++) {
    const before = row;
    row = [i + 1];
    for (let j = 0; j < other.length; j++)
      row.push(Math.min(before[j + 1] + 1, row[j] + 1, before[j] + (one[i] !== other[j])));
  }
  return row[other.length];
}

// What a word may stand for: itself, longer and shorter forms, what else it is called; if none, the word mistyped.
function meant(word) {
  const known = [...index.having.keys()], own = stem(word), found = new Map([[own, 1]]);
  for (const other of known) {
    const [short, long] = own.length < other.length ? [own, other] : [other, own];
    if (short !== long && long.startsWith(short) && short.length > (short === own ? 2 : 3))
      found.set(other, 0.6 * short.length / long.length);
  }
  for (const other of same.get(own) ?? []) found.set(other, Math.max(found.get(other) ?? 0, 0.4));
  if (found.size > 1 || index.having.has(own) || own.length < 4) return found;
  for (const other of known) if (mistypings(own, other) <= (own.length > 7 ? 2 : 1)) found.set(other, 0.5);
  return found;
}

function setUp({ config, items }) {
  separator = new RegExp(config.separator, "u");
  same = new Map();
  for (const group of SAME.map(names => names.split(" ").map(stem)))
    for (const one of group) same.set(one, group.filter(other => other !== one));
  sections = items.map(({ title, path, text }) => ({ title: words(title), path: words(path.join("")), text: words(text) }));
  const whole = {}, names = items.map(item => item.location.split("#")[0]);
  names.forEach((name, k) => {
    const { title, path, text } = sections[k], page = whole[name] ??= { title: [], path, text: [] };
    page[items[k].level === 1 ? "title" : "text"].push(...title);
    page.text.push(...text);
  });
  index = new Ranked(sections);
  const all = Object.keys(whole), listed = all.map((name, k) => k === 0 || name.includes("/reference/"));
  pages = { index: new Ranked(Object.values(whole)), listed, of: names.map(name => all.indexOf(name)) };
}

function hits(question, asked) {
  const whole = pages.index.scores(asked), best = (a, b) => b.score - a.score, listed = {};
  const found = [...index.scores(asked)].flatMap((score, id) => {
    const worth = pages.listed[pages.of[id]] && !NAME.test(question) ? LISTED : 1;
    return score ? [{ id, score: worth * (score + PAGE * whole[pages.of[id]]) }] : [];
  }).sort(best);
  for (const hit of found) {
    const page = pages.of[hit.id];
    hit.score *= AGAIN ** (listed[page] = (listed[page] ?? -1) + 1);
  }
  return found.sort(best).slice(0, MOST).filter(({ score }) => score >= LEAST * found[0].score);
}

function answer({ input }) {
  const question = typeof input === "string" ? input : "";
  const typed = question.split(separator).flatMap(part => words(part).map(({ start, end }) => plain(part.slice(start, end))));
  const asked = typed.map(meant), all = new Set(asked.flatMap(found => [...found.keys()]));
  const items = hits(question, asked).map(({ id, score }) => ({ id, score, matches: Object.keys(WEIGHT).map(field => {
    const marked = sections[id][field].filter(({ stem }) => all.has(stem));
    const ranges = marked.map(({ start, end }) => ({ start, end, value: end - start }));
    return { id, field, score, value: { highlight: { ranges } } };
  }) }));
  return { items, aggregations: [], pagination: { total: items.length } };
}

self.onmessage = ({ data: { type, data } }) => {
  try {
    if (type === 0) setUp(data);
    self.postMessage(type === 0 ? { type: 1 } : { type: 3, data: answer(data) });
  } catch {
    self.postMessage({ type: 4 });
  }
};
