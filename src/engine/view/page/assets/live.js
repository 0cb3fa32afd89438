// A store in the browser: the server that sent this page cuts, counts and finds; this script draws and asks.

const TAKEN = [255, 122, 0];

// An answer, or the sentence of its refusal. A newer question of the same kind ends the older one, on the server too.
const asked = {};
async function ask(kind, path, parameters) {
  asked[kind]?.abort();
  const control = (asked[kind] = new AbortController());
  const headers = { "X-Tetdb-Token": data.token };
  let reply;
  try {
    reply = await fetch(`/${path}?${new URLSearchParams(parameters)}`, { headers, signal: control.signal });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Error("The server does not answer; was it stopped?");
  }
  if (reply.ok) return reply;
  const { code, message, where } = (await reply.json()).error;
  const help = code === "store-changed" ? " Start `tetdb view` again." : "";
  throw new Error((where ? `${message} (${where})` : message) + help);
}

// Triangles: a line of JSON, the packed surface, the values.
async function triangles(kind, path, parameters) {
  const bytes = new Uint8Array(await (await ask(kind, path, parameters)).arrayBuffer());
  const end = bytes.indexOf(10);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  const packed = bytes.subarray(end + 1, end + 1 + head.bytes);
  const surface = unpackBytes((at) => packed[at]);
  head.columns.forEach((name, k) => (surface[name] = surface.channels[k]));
  const values = new Float32Array(bytes.slice(end + 1 + head.bytes).buffer);
  return Object.assign(surface, { head, values: head.values ? values : null, value: parameters.value });
}

function say(id, text, isBad = false) {
  byId(id).textContent = text;
  byId(id).classList.toggle("bad", isBad);
}

function live() {
  const form = byId("controls"), canvas = byId("canvas"), { low, high } = data.scene;
  const several = data.subdomains.length > 1;
  byId("title").textContent = data.title;
  byId("origin").textContent = `${count(data.counts.tets)} tetrahedra in ${count(data.subdomains.length)} sub-domain${several ? "s" : ""} · ${data.state}`;
  let view;
  try {
    view = new View(canvas);
  } catch (error) {
    byId("message").textContent = `This browser cannot draw in space (${error.message}). \`tetdb snapshot\` draws pictures.`;
    byId("message").hidden = false;
    document.body.dataset.view = "none";
    return;
  }

  // Surfaces on the screen by name; `condition` is the one whose answers are shown, `cut` the plane of the section.
  const shown = {}, hidden = new Set();
  let condition = "", cut = null, painted = "";

  const columns = data.fields.flatMap((field) => field.columns.map((name, k) => ({ name, range: [field.ranges[k].low, field.ranges[k].high] })));
  const variables = data.variables.filter((name) => !["region", "subdomain"].includes(name));
  const options = [["sub-domain", "subdomain"], ["region", "region"], ["label", "label"], ...variables.map((name) => [name.replace("_", " "), name]), ...columns.map(({ name }) => [name, name])];
  form.color.append(...options.map(([textContent, value]) => make("option", { textContent, value })));
  form.color.value = several ? "subdomain" : data.regions.filter((r) => r.filled).length > 1 ? "region" : "quality";
  const isKind = (color) => ["subdomain", "region", "label"].includes(color);
  const valueOf = () => (isKind(form.color.value) ? "quality" : form.color.value);

  // The plane of the controls: where it is along a direction, and its normal towards what is left out.
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  function plane() {
    const axis = form.axis.value;
    if (axis === "none") return null;
    const along = axis === "free" ? [form.nx, form.ny, form.nz].map((input) => Number(input.value)) : [0, 1, 2].map((k) => Number(k === Number(axis)));
    const length = Math.hypot(...along);
    if (!(length > 0)) return null;
    const d = along.map((x) => x / length);
    const [least, most] = [0, 1].map((end) => d.reduce((sum, x, k) => sum + x * (x > 0 === (end === 1) ? high : low)[k], 0));
    const at = least + ((most - least) * form.place.value) / 1000;
    const middle = low.map((x, k) => (x + high[k]) / 2);
    // As in the first view, which is from high x and z and from low y.
    const sign = (axis === "1") !== form.other.checked ? -1 : 1;
    return { at, offset: sign * at, normal: d.map((x) => sign * x), point: middle.map((x, k) => x + d[k] * (at - dot(middle, d))) };
  }
  const line = (a, b) => [...a, ...b].join(",");
  const clip = () => cut && [...cut.normal, (cut.offset - dot(low, cut.normal)) / view.side];

  // Colors of surfaces: by number, or by a scale where there are values.
  function range() {
    const color = form.color.value;
    if (isKind(color)) return null;
    const field = columns.find(({ name }) => name === color);
    const found = [shown.section, shown.answers].filter((s) => s?.value === color && s.head.range[0] !== null).map((s) => s.head.range);
    const own = color === "quality" ? [1, 3] : field ? field.range : [Math.min(...found.map((r) => r[0])), Math.max(...found.map((r) => r[1]))];
    const typed = [form.least, form.most].map((input, k) => (input.value === "" ? own[k] : Number(input.value)));
    return typed.every(Number.isFinite) ? typed : [0, 1];
  }
  function paint() {
    const color = form.color.value, ends = range();
    const wanted = JSON.stringify([color, ends]);
    for (const [name, surface] of Object.entries(shown)) {
      if (surface.painted === wanted) continue;
      surface.painted = wanted;
      const kinds = name.startsWith("high") && color === "subdomain" ? surface.other : surface[color];
      const share = (i) => (surface.values[i] - ends[0]) / (ends[1] - ends[0] || 1);
      if (name === "taken") view.color(name, () => TAKEN);
      else if (!ends) view.color(name, (i) => (kinds ? kind(kinds[i]) : GRAY));
      // Values of another color stay gray until those of this one are there.
      else view.color(name, (i) => (surface.values && surface.value === color && !Number.isNaN(surface.values[i]) ? scale(share(i)) : GRAY));
    }
    if (painted === wanted) return;
    painted = wanted;
    const box = byId("legend");
    box.replaceChildren();
    ends ? ramp(box, ends, color === "quality") : swatches(box, kindsOf(color));
    byId("range").hidden = !ends;
  }

  function draw() {
    paint();
    const list = [], here = clip();
    if (shown.section && cut) list.push({ name: "section", flat: true });
    if (shown.answers) list.push({ name: "answers", clip: here });
    for (const name of Object.keys(shown)) {
      if (name.startsWith("boundary") && form.boundary.checked && !condition) list.push({ name, clip: here });
      if (/^(low|high)/.test(name) && form.interfaces.checked && !condition) list.push({ name, clip: here, cull: true });
    }
    if (shown.taken) list.push({ name: "taken", over: true });
    view.draw({ apart: 0, edges: form.edges.checked, shown: list });
  }
  let due = false;
  const later = () => {
    if (due) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      draw();
    });
  };
  const put = (name, surface, ranks, masks, turned) => {
    view.add(name, surface, ranks, masks, turned);
    shown[name] = surface;
    surface.painted = "";
    later();
  };
  const drop = (name) => {
    view.remove(name);
    delete shown[name];
    later();
  };

  function thinned() {
    const told = [];
    const sum = (test) => Object.entries(shown).filter(([name, s]) => test.test(name) && s.head).reduce(([a, b], [, s]) => [a + s.head.shown, b + s.head.of], [0, 0]);
    for (const [what, test] of [["the boundary", /^boundary/], ["the interfaces", /^low/], ["the section", /^section/]]) {
      const [some, all] = sum(test);
      if (some < all && Object.entries(shown).some(([name, s]) => test.test(name) && s.head?.joined)) told.push(`${what} to ${count(some)} of ${count(all)} triangles`);
    }
    byId("shown").textContent = told.length ? `Thinned out for the eye: ${told.join(", ")}.` : "";
  }

  async function surfaces() {
    const bare = (surface) => (surface.head.joined ? new Uint8Array(surface.nTriangles) : null);
    const began = performance.now();
    const get = async (path, share) => {
      const surface = await triangles(`${path} ${share}`, path, { share });
      if (path === "boundary") put(`boundary ${share}`, surface, surface.subdomain, bare(surface));
      else {
        put(`low ${share}`, surface, surface.subdomain, bare(surface));
        put(`high ${share}`, { ...surface, head: null }, surface.other, bare(surface), true);
      }
      if (document.body.dataset.view !== "drawn") document.body.dataset.first = Math.round(performance.now() - began);
      document.body.dataset.view = "drawn";
      thinned();
    };
    say("status", "reading the surface …");
    const all = async (path) => {
      for (let share = 0; share < data.shares[path]; share++) await get(path, share);
    };
    await Promise.all([all("boundary"), several && all("interfaces")]);
    if (byId("status").textContent.startsWith("reading")) say("status", "");
    document.body.dataset.surface = "complete";
  }

  // The section follows the controls; while they move, one is asked for at most as often as one is answered.
  let pause = 0, timer = null;
  function slice() {
    clearTimeout(timer);
    byId("free").hidden = form.axis.value !== "free";
    const next = plane();
    const axis = form.axis.value;
    byId("at").textContent = next ? `${axis === "free" ? "" : "xyz"[axis] + " = "}${number(next.at)}` : "";
    if (!next) {
      asked.section?.abort();
      cut = null;
      say("status", axis === "free" ? "A direction has a number that is not 0." : "", axis === "free");
      drop("section");
      thinned();
      return;
    }
    timer = setTimeout(async () => {
      const began = performance.now();
      say("status", "cutting …");
      try {
        const found = await triangles("section", "section", { plane: line(next.point, next.normal), value: valueOf(), where: condition });
        cut = next;
        put("section", found, found.subdomain, found.head.joined ? new Uint8Array(found.nTriangles) : found.edges);
        pause = Math.min(performance.now() - began, 1000);
        document.body.dataset.cut = Math.round(pause);
        say("status", `The plane cuts ${count(found.head.tets)} tetrahedra.`);
        thinned();
      } catch (error) {
        if (error.name !== "AbortError") say("status", error.message, true);
      }
    }, pause);
  }

  async function find(text = byId("condition").value.trim()) {
    if (!text) return forget();
    say("answer", "counting …");
    try {
      const began = performance.now();
      const found = await triangles("answers", "answers", { where: text, value: valueOf() });
      condition = text;
      byId("forget").disabled = false;
      put("answers", found, found.subdomain, null);
      document.body.dataset.answers = Math.round(performance.now() - began);
      const { tets, drawn } = found.head;
      say("answer", `${count(tets)} tetrahedr${tets === 1 ? "on" : "a"}${drawn < tets ? `; ${count(drawn)} of them are drawn, spread over all` : ""}.`);
      if (form.axis.value !== "none") slice();
    } catch (error) {
      if (error.name !== "AbortError") say("answer", error.message, true);
    }
  }
  function forget() {
    asked.answers?.abort();
    condition = "";
    byId("forget").disabled = true;
    say("answer", "");
    drop("answers");
    if (form.axis.value !== "none") slice();
  }

  async function pick(x, y) {
    const [from, to] = view.ray(x, y);
    const parameters = { ray: line(from.map((s, k) => low[k] + s * view.side), to), where: condition, hidden: [...hidden].join(",") };
    if (cut) parameters.clip = line(cut.point, cut.normal);
    const began = performance.now();
    try {
      const tet = await (await ask("pick", "pick", parameters)).json();
      document.body.dataset.pick = Math.round(performance.now() - began);
      if (!tet) {
        drop("taken");
        byId("picked").replaceChildren(make("p", { className: "note", textContent: "There is no tetrahedron." }));
        return;
      }
      const spot = (p) => p.map((c) => number(c, 6)).join(", ");
      const rows = [
        ["id", tet.id], ["sub-domain", make("span", {}, String(tet.subdomain), swatch(tet.subdomain))], ["region", make("span", {}, String(tet.region), swatch(tet.region))],
        ["quality", number(tet.quality, 6)], ["volume", number(tet.volume, 6)], ["edges", `${number(tet.edge_min, 5)} to ${number(tet.edge_max, 5)}`],
        ["dihedral angles", `${number(tet.angle_min, 4)}° to ${number(tet.angle_max, 4)}°`],
        ...tet.points.map((p, k) => [tet.vertices[k], spot(p)]), ...tet.fields.map(([name, x]) => [name, number(x, 7)]),
      ];
      const body = rows.map(([name, x]) => make("tr", {}, make("th", { textContent: name, scope: "row" }), make("td", {}, x)));
      byId("picked").replaceChildren(make("table", {}, make("tbody", {}, ...body)));
      const points = tet.points.flatMap((p) => p.map((c, k) => Math.round((65535 * (c - low[k])) / view.side)));
      put("taken", { nTriangles: 4, points, corners: [1, 2, 3, 0, 3, 2, 0, 1, 3, 0, 2, 1] }, new Array(4).fill(tet.subdomain), null);
    } catch (error) {
      if (error.name !== "AbortError") say("status", error.message, true);
    }
  }

  function parts() {
    if (!several) return (byId("parts").hidden = true);
    const hide = () => {
      view.middles(hidden);
      later();
    };
    const boxes = data.subdomains.map((s) => {
      const box = make("input", { type: "checkbox", checked: true });
      box.addEventListener("input", (event) => {
        event.stopPropagation();
        box.checked ? hidden.delete(s.id) : hidden.add(s.id);
        hide();
      });
      return [box, make("label", {}, make("span", {}, box, swatch(s.id), String(s.id)), count(s.tets))];
    });
    byId("parts").querySelector(".scroll").append(...boxes.map(([, label]) => label));
    byId("all").addEventListener("click", () => {
      hidden.clear();
      for (const [box] of boxes) box.checked = true;
      hide();
    });
  }

  form.addEventListener("input", (event) => {
    const { name } = event.target;
    if (["axis", "place", "other", "nx", "ny", "nz"].includes(name)) slice();
    if (name === "color") {
      form.least.value = form.most.value = "";
      if (cut && !isKind(form.color.value)) slice();
      if (condition && !isKind(form.color.value)) find(condition);
    }
    later();
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  byId("condition").addEventListener("keydown", (event) => event.key === "Enter" && find());
  byId("find").addEventListener("click", () => find());
  byId("forget").addEventListener("click", forget);
  byId("facing").addEventListener("click", () => {
    const { turn } = view.look(0);
    [form.nx.value, form.ny.value, form.nz.value] = [2, 6, 10].map((k) => turn[k].toFixed(4));
    slice();
  });
  new ResizeObserver(later).observe(canvas);
  const home = () => view.home();
  turnable(view, later, home, pick);
  if (!several) form.interfaces.parentElement.hidden = true;
  parts();
  home();
  later();
  // What is missing of the surface stays said, whatever is asked next.
  surfaces().catch((error) => {
    byId("message").textContent = `The surface is not complete: ${error.message}`;
    byId("message").hidden = false;
  });
}
// The address keeps a token that is good for a second time.
history.replaceState(null, "", `/?token=${data.token}`);
live();
