// Everything of the page but the view in space.

const { counts, statistics, steps } = data;

function figures() {
  const card = (value, what) => byId("figures").append(make("div", {}, make("b", { textContent: value }), make("span", { textContent: what })));
  card(count(counts.tets), "tetrahedra");
  card(count(counts.vertices), "vertices");
  if (counts.triangles !== null) card(count(counts.triangles), "input triangles, all kept");
  card(count(counts.subdomains), counts.subdomains === 1 ? "sub-domain" : "sub-domains");
  card(number(counts.volume, 6), "volume");
  card(percent(data.bins[0] / counts.tets), "with quality below 2");
  card(number(counts.worst), "worst quality");
  card((counts.bytes / counts.tets).toFixed(2) + " B", `a tetrahedron, ${bytes(counts.bytes)} on disk`);
}

function quality() {
  const total = data.bins.reduce((a, b) => a + b, 0);
  const last = data.bins.reduce((last, n, i) => (n ? i : last), 0);
  const rows = data.bins.map((n, i) => [i, n]).filter(([i]) => i <= last);
  byId("quality").append(table([
    ["q", ([i]) => (i < 9 ? `[${i + 1}, ${i + 2}[` : "[10, ∞["), "left"],
    ["tetrahedra", ([, n]) => count(n)],
    ["share", ([, n]) => percent(n / total, 4)],
    ["", ([, n]) => fill(n / total), "track"],
  ], rows));
  byId("quality").append(make("p", { className: "note", textContent: `mean ${statistics.quality_mean.toFixed(4)}, worst ${number(counts.worst)}; dihedral angles from ${counts.dihedral[0].toFixed(2)}° to ${counts.dihedral[1].toFixed(2)}°. Excess, the quality over the least that the input triangles allow: worst ${number(statistics.excess.worst)}, above 2 for ${percent(statistics.excess.above_two / total, 3)}` }));
  byId("quality-chart").append(histogram([[statistics.quality.bins, "", ""]], { least: 1, width: statistics.quality.width, step: 0.25, marks: [[statistics.quality_mean, "mean"]] }));
  byId("angles").append(histogram([[statistics.angles.bins, "", ""]], { least: 0, width: 2, unit: "°", step: 30, marks: [[70.5288, "regular: 70.5°"]] }));
}

function edges() {
  const e = statistics.edges;
  const about = e.edges === e.of_about ? `all ${count(e.edges)} edges` : `${count(e.edges)} of about ${number(e.of_about, 3)} edges, drawn evenly`;
  byId("edges").append(make("p", { className: "note" },
    `Length / wanted length, ${about}. With a new end: median ${e.median.toFixed(3)}, ${percent(e.share_near, 1)} within [1/√2, √2]. `,
    make("br"), make("span", { className: "key" }), "with a new end", make("span", { className: "key second" }), "between vertices of the input"));
  byId("edges").append(histogram([[e.bins, "", "with a new end"], [e.given_bins, "second", "between vertices of the input"]], { least: 0, width: 0.05, step: 0.5, marks: [[1, "as wanted"]] }));
}

function subdomains() {
  const list = data.subdomains;
  if (list.length < 2) return byId("subdomains").remove();
  const loaded = list.filter((s) => s.predicted);
  if (loaded.length && loaded.length <= 400) {
    byId("subdomains").append(make("p", { className: "note" },
      make("span", { className: "key second" }), "tetrahedra predicted by the load", make("span", { className: "key" }), "made"));
    byId("subdomains").append(pairs(loaded.map((s) => [s.id, s.predicted, s.tets])));
  }
  byId("subdomains").append(table([
    ["sub-domain", (s) => { const i = make("i", {}); i.style.cssText = `display:inline-block;width:12px;height:12px;border-radius:3px;margin-right:7px;vertical-align:-1px;background:${css(kind(s.id))}`; const cell = make("span", {}); cell.append(i, String(s.id)); return cell; }, "left"],
    ["tetrahedra", (s) => count(s.tets)],
    ["predicted", (s) => (s.predicted ? count(Math.round(s.predicted)) : null)],
    ["made / pred.", (s) => (s.predicted ? (s.tets / s.predicted).toFixed(3) : null)],
    ["vertices", (s) => count(s.vertices)],
    ["input triangles", (s) => count(s.facets)],
    ["interface faces", (s) => count(s.faces)],
    ["neighbors", (s) => s.neighbors],
    ["q < 2", (s) => percent(s.near)],
    ["worst q", (s) => number(s.worst)],
    ["on disk", (s) => bytes(s.bytes)],
  ], list));
}

// A row has its place in the journal, its seconds, then a value for each name.
const value = (step, row, name) => {
  const at = step.names.indexOf(name);
  return at < 0 ? undefined : row[at + 2];
};
const stepOf = (name) => steps.find((s) => s.step === name);

function interfaces() {
  const bisect = stepOf("bisect");
  if (!bisect) return byId("interfaces").remove();
  const v = (name) => (row) => value(bisect, row, name);
  const n = (name) => (row) => (v(name)(row) === undefined || v(name)(row) === null ? null : count(v(name)(row)));
  const faces = new Map();
  for (const [cut, , , number] of data.interfaces) faces.set(cut, (faces.get(cut) || 0) + number);
  const sum = (name) => bisect.rows.reduce((total, row) => total + (v(name)(row) || 0), 0);
  const saved = 1 - sum("interface_faces") / sum("natural_faces");
  byId("interfaces").append(make("p", { className: "note", textContent: `${bisect.rows.length} cuts: ${count(sum("natural_faces"))} faces of the natural interfaces became ${count(sum("interface_faces"))}, ${percent(saved, 1)} fewer. An over-constrained tetrahedron has all its vertices on the interface; a pinched edge has more than two of its faces.` }));
  byId("interfaces").append(table([
    ["cut", (r) => v("cut")(r), "left"],
    ["natural faces", n("natural_faces")],
    ["chosen", n("interface_faces")],
    ["fewer", (r) => percent(1 - v("interface_faces")(r) / v("natural_faces")(r), 1)],
    ["over-constrained, before", n("natural_over_constrained")],
    ["after", n("over_constrained")],
    ["pinched, before", n("natural_pinched")],
    ["after", n("pinched")],
    ["at surface", n("at_surface")],
    ["Z", n("z_tets")],
    ["zone vertices", n("zone_vertices")],
    ["frozen hits", n("frozen_hits")],
    ["zone rejects", n("zone_rejects")],
    ["pairs of sub-domains", (r) => count(data.interfaces.filter(([cut]) => cut === v("cut")(r)).length)],
  ], bisect.rows));
}

const PHASES = ["plane_s", "zone_s", "core_s", "interface_s", "refine_s", "optimize_s", "seal_s", "mesh_s", "recover_s"];

function work() {
  const rows = steps.flatMap((step) => step.rows.map((row) => ({ step, row })));
  rows.sort((a, b) => a.row[0] - b.row[0]);
  const longest = Math.max(...rows.map(({ row }) => row[1])) || 1;
  const get = ({ step, row }, name) => value(step, row, name);
  const totals = steps.map((s) => `${s.step} ${seconds(s.rows.reduce((t, r) => t + r[1], 0))}`);
  byId("steps").append(make("p", { className: "note", textContent: `Seconds of work, in the order the steps ended; steps of different sub-domains may have run side by side. In all: ${totals.join("; ")}.` }));
  const phases = (r) => PHASES.filter((p) => get(r, p) !== undefined).map((p) => `${p.slice(0, -2)} ${seconds(get(r, p))}`).join(", ");
  byId("steps").append(table([
    ["step", (r) => r.step.step, "left"],
    ["sub-domain", (r) => { const rank = get(r, "subdomain"); return rank === null || rank === undefined ? null : String(rank); }],
    ["time", (r) => seconds(r.row[1])],
    ["", (r) => fill(r.row[1] / longest), "track"],
    ["of it", phases, "left text"],
    ["pages read", (r) => (get(r, "pages_read") === undefined ? null : count(get(r, "pages_read")))],
    ["written", (r) => (get(r, "pages_written") === undefined ? null : count(get(r, "pages_written")))],
    ["frames", (r) => (get(r, "frames_used") === undefined ? null : bytes(get(r, "frames_used") * 65536))],
  ], rows));
}

function regions() {
  const filled = data.regions.filter((r) => r.filled), empty = data.regions.filter((r) => !r.filled);
  const list = [...filled.slice(0, 500), ...(empty.length > 8 ? [] : empty)];
  byId("regions").append(table([
    ["region", (r) => (r.filled ? r.region : null), "left"],
    ["", (r) => (r.filled ? "filled" : "empty"), "left"],
    ["volume", (r) => number(r.volume, 6)],
    ["tetrahedra", (r) => (r.filled ? count(r.tets) : null)],
    ["labels around it", (r) => r.labels.join(", "), "left text"],
  ], list));
  const more = [];
  if (filled.length > 500) more.push(`${count(filled.length)} filled regions in all`);
  if (empty.length > 8) more.push(`${count(empty.length)} empty regions with a volume of ${number(empty.reduce((sum, r) => sum + r.volume, 0), 6)} together`);
  if (more.length) byId("regions").append(make("p", { className: "note", textContent: more.join("; ") }));
}

function made() {
  const list = make("dl", {});
  const line = (name, text) => text && list.append(make("dt", { textContent: name }), make("dd", {}, make("code", { textContent: text })));
  line("store", data.store);
  line("state", data.state);
  line("digest", data.digest);
  line("surface", data.surfaces.join("\n"));
  line("options", Object.entries(data.options || {}).filter(([, v]) => v !== null && !(Array.isArray(v) && !v.length)).map(([k, v]) => `${k} = ${JSON.stringify(v)}`).join(", ") || "defaults");
  line("tetdb", data.version);
  byId("made").append(list);
}

byId("title").textContent = data.title;
document.title = data.title + " – tetdb";
byId("origin").textContent = `from ${data.surfaces.join(", ")} · ${data.state}`;
figures();
quality();
edges();
subdomains();
interfaces();
work();
regions();
made();
