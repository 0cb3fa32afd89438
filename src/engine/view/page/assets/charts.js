// Charts as SVG, tables as tables.

function svg(name, attributes, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) element.setAttribute(key, attributes[key]);
  if (text !== undefined) element.textContent = text;
  return element;
}

// Round numbers that divide 0 to `most` into a few steps.
function ticks(most, steps = 5) {
  const raw = most / steps;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].find((k) => k * power >= raw) * power;
  const list = [];
  for (let x = 0; x <= most * (1 + 1e-9); x += step) list.push(x);
  return list;
}

const WIDE = 560, TALL = 250, LEFT = 46, FOOT = 26, TOP = 10;

// Bars over [least, most], one series on the other; each is [bins, class, name].
function histogram(series, { least, width, unit = "", marks = [], step }) {
  const bins = series[0][0].length;
  const most = least + bins * width;
  const total = series.reduce((sum, [list]) => sum + list.reduce((a, b) => a + b, 0), 0) || 1;
  let peak = 0;
  for (let i = 0; i < bins; i++) peak = Math.max(peak, series.reduce((sum, [list]) => sum + list[i], 0) / total);
  const x = (v) => LEFT + ((WIDE - LEFT - 8) * (v - least)) / (most - least);
  const y = (share) => TALL - FOOT - ((TALL - FOOT - TOP) * share) / (peak || 1);
  const root = svg("svg", { viewBox: `0 0 ${WIDE} ${TALL}`, role: "img" });
  for (const t of ticks(peak || 1)) {
    root.append(svg("line", { class: "grid", x1: LEFT, x2: WIDE - 8, y1: y(t), y2: y(t) }));
    root.append(svg("text", { x: LEFT - 6, y: y(t) + 4, "text-anchor": "end" }, number(100 * t, 2) + " %"));
  }
  const below = new Array(bins).fill(0);
  for (const [list, name, title] of series) {
    list.forEach((n, i) => {
      if (!n) return;
      const from = x(least + i * width), to = x(least + (i + 1) * width), foot = y(below[i] / total);
      below[i] += n;
      const top = y(below[i] / total);
      const bar = svg("rect", { class: "bar " + name, x: from, y: top, width: Math.max(to - from - 0.6, 0.6), height: foot - top });
      const range = i + 1 === bins && !unit ? `${number(least + i * width)} and more` : `${number(least + i * width)} to ${number(least + (i + 1) * width)}${unit}`;
      bar.append(svg("title", {}, `${title ? title + ", " : ""}${range}: ${count(n)} (${percent(n / total, 3)})`));
      root.append(bar);
    });
  }
  for (const [at, text] of marks) {
    root.append(svg("line", { class: "mark", x1: x(at), x2: x(at), y1: TOP, y2: TALL - FOOT }));
    const end = x(at) > WIDE - 120;
    root.append(svg("text", { x: x(at) + (end ? -5 : 5), y: TOP + 10, "text-anchor": end ? "end" : "start" }, text));
  }
  root.append(svg("line", { class: "axis", x1: LEFT, x2: WIDE - 8, y1: TALL - FOOT, y2: TALL - FOOT }));
  for (let v = least; v <= most + 1e-9; v += step) {
    root.append(svg("text", { x: x(v), y: TALL - 9, "text-anchor": "middle" }, number(v, 3) + unit));
  }
  return root;
}

// Pairs of bars, or a cloud of points where they are many: predicted and true.
function pairs(rows) {
  const root = svg("svg", { viewBox: `0 0 ${2 * WIDE} ${TALL}`, role: "img" });
  const most = Math.max(...rows.map((r) => Math.max(r[1], r[2]))) || 1;
  const y = (n) => TALL - FOOT - ((TALL - FOOT - TOP) * n) / most;
  const wide = (2 * WIDE - LEFT - 30) / rows.length;
  for (const t of ticks(most, 4)) {
    root.append(svg("line", { class: "grid", x1: LEFT + 20, x2: 2 * WIDE - 8, y1: y(t), y2: y(t) }));
    root.append(svg("text", { x: LEFT + 14, y: y(t) + 4, "text-anchor": "end" }, count(Math.round(t))));
  }
  rows.forEach(([name, predicted, real], i) => {
    const left = LEFT + 22 + i * wide, bar = wide * 0.4;
    [[predicted, "second", "predicted"], [real, "", "made"]].forEach(([n, cls, what], s) => {
      const rect = svg("rect", { class: "bar " + cls, x: left + wide * 0.1 + s * bar, width: Math.max(bar - 1, 0.5), y: y(n), height: TALL - FOOT - y(n) });
      rect.append(svg("title", {}, `sub-domain ${name}: ${count(Math.round(n))} ${what} (made / predicted ${(real / predicted).toFixed(3)})`));
      root.append(rect);
    });
    if (rows.length <= 40) root.append(svg("text", { x: left + wide / 2, y: TALL - 9, "text-anchor": "middle" }, name));
  });
  root.append(svg("line", { class: "axis", x1: LEFT + 20, x2: 2 * WIDE - 8, y1: TALL - FOOT, y2: TALL - FOOT }));
  return root;
}

// Columns are [head, value of a row, class]; a value may be a node.
function table(columns, rows) {
  const head = make("tr", {}, ...columns.map(([name, , cls]) => make("th", { className: cls || "", textContent: name })));
  const body = rows.map((row) => make("tr", {}, ...columns.map(([, value, cls]) => {
    const cell = make("td", { className: cls || "" });
    const content = value(row);
    cell.append(content === null || content === undefined ? "–" : content);
    return cell;
  })));
  const whole = make("table", {}, make("thead", {}, head), make("tbody", {}, ...body));
  return make("div", { className: "scroll" }, whole);
}

function fill(share) {
  const bar = make("span", { className: "fill" });
  bar.style.width = Math.max(100 * share, 0.4) + "%";
  return bar;
}
