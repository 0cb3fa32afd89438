// What is shown of the mesh in space, and how it is turned.

function stage() {
  const form = byId("controls"), canvas = byId("canvas"), scene = data.scene;
  let view;
  try {
    view = new View(canvas);
  } catch (error) {
    const message = byId("message");
    message.textContent = `This browser cannot draw in space (${error.message}). Everything else on this page is complete; \`tetdb snapshot\` draws pictures.`;
    message.hidden = false;
    form.hidden = true;
    document.querySelector(".hint").hidden = true;
    document.body.dataset.view = "none";
    return;
  }
  const axes = ["x", "y", "z"];
  const skin = unpack("surface-boundary"), walls = unpack("surface-interfaces");
  const cuts = scene.cuts.map((cut) => ({ ...cut, packed: null }));
  view.add("boundary", skin, skin.channels[0], scene.boundary.joined ? new Uint8Array(skin.nTriangles) : null);
  const bare = scene.interfaces.joined ? new Uint8Array(walls.nTriangles) : null;
  view.add("walls-low", walls, walls.channels[0], bare);
  view.add("walls-high", walls, walls.channels[1], bare, true);

  const state = () => ({
    boundary: form.boundary.checked, interfaces: form.interfaces.checked, edges: form.edges.checked,
    axis: form.axis.value === "none" ? null : Number(form.axis.value), place: Number(form.place.value),
    other: form.other.checked, color: form.color.value, apart: Number(form.apart.value) / 100,
  });
  const places = cuts.length / 3;
  const cutOf = ({ axis, place }) => (axis === null ? null : cuts[axis * places + place]);

  // Colors of the sub-domain, the region and the label are by number; of values, by a scale.
  const inks = {
    subdomain: { skin: (i) => kind(skin.channels[0][i]), wall: (c, i) => kind(walls.channels[c][i]), cross: (p, i) => kind(p.channels[0][i]) },
    region: { skin: (i) => kind(skin.channels[1][i]), cross: (p, i) => kind(p.channels[1][i]) },
    label: { skin: (i) => kind(skin.channels[2][i]) },
    quality: { cross: (p, i) => scale(p.channels[2][i] / 255) },
    size: { cross: (p, i) => scale(p.channels[3][i] / 255) },
  };
  const gray = () => GRAY;
  function paint(color) {
    const ink = inks[color];
    view.color("boundary", ink.skin || gray);
    view.color("walls-low", ink.wall ? (i) => ink.wall(0, i) : gray);
    view.color("walls-high", ink.wall ? (i) => ink.wall(1, i) : gray);
    for (const cut of cuts) cut.color = null;
  }
  function ready(cut, color) {
    const name = `cut-${axes[cut.axis]}-${cut.place}`;
    if (!cut.packed) {
      cut.packed = unpack("surface-" + name);
      view.add(name, cut.packed, cut.packed.channels[0], cut.joined ? new Uint8Array(cut.packed.nTriangles) : cut.packed.channels[4]);
    }
    if (cut.color !== color) {
      const { cross } = inks[color];
      view.color(name, cross ? (i) => cross(cut.packed, i) : gray);
      cut.color = color;
    }
    return name;
  }

  // What is left out: in the first view that is from high x and z and from low y, what is nearer.
  function clipOf(now) {
    const cut = cutOf(now);
    if (!cut) return null;
    const sign = (cut.axis === 1) !== now.other ? -1 : 1;
    const clip = [0, 0, 0, (sign * (cut.at - scene.low[cut.axis])) / view.side];
    clip[cut.axis] = sign;
    return clip;
  }
  const home = () => view.home(state().axis, clipOf(state()));

  let painted = null;
  function draw() {
    const now = state();
    if (painted !== now.color) {
      paint(now.color);
      legend(now.color);
      painted = now.color;
    }
    const cut = cutOf(now), shown = [], clip = clipOf(now);
    if (cut) {
      shown.push({ name: ready(cut, now.color), flat: true });
      byId("where").textContent = `${axes[cut.axis]} = ${number(cut.at)}`;
    } else {
      byId("where").textContent = "";
    }
    if (now.boundary) shown.push({ name: "boundary", clip });
    if (now.interfaces) {
      const cull = now.apart === 0;
      shown.push({ name: "walls-low", clip, cull }, { name: "walls-high", clip, cull });
    }
    view.draw({ ...now, shown });
    document.body.dataset.view = "drawn";
  }

  function legend(color) {
    const box = byId("legend");
    box.replaceChildren();
    if (color === "quality") return ramp(box, scene.quality, true);
    if (color === "size") return ramp(box, scene.size, false);
    swatches(box, kindsOf(color));
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
  form.addEventListener("input", later);
  form.addEventListener("submit", (event) => event.preventDefault());
  new ResizeObserver(later).observe(canvas);

  turnable(view, later, home);

  form.place.max = places - 1;
  form.place.value = Math.floor(places / 2);
  form.axis.value = String(scene.axis);
  if (data.subdomains.length < 2) {
    byId("apart").hidden = true;
    form.interfaces.parentElement.hidden = true;
    form.color.value = data.regions.filter((r) => r.filled).length > 1 ? "region" : "quality";
  }
  const told = [["boundary", scene.boundary], ["interfaces", scene.interfaces]].filter(([, p]) => p.joined).map(([name, p]) => `the ${name} by ${count(p.shown)} of ${count(p.of)} triangles`);
  if (cuts.some((c) => c.joined)) told.push("the cuts by fewer polygons than they have");
  if (told.length) byId("shown").textContent = `For the eye only: this page shows ${told.join(", ")}; vertices within about ${number(scene.boundary.joined || scene.interfaces.joined || Math.max(...cuts.map((c) => c.joined)), 2)} of each other were joined. All numbers are those of the whole mesh.`;
  home();
  draw();
}
stage();
