// The report's script: linked pictures, one choice everywhere, files to save. It sets texts only.
const specs = read("specs");
const views = new Map();
let chosen = "";

/** Colours of the linked pictures: those of the text, on light, dark and printed paper alike. */
const ink = "currentColor";
const axis = { labelColor: ink, titleColor: ink, gridColor: ink, gridOpacity: 0.15, domainColor: ink,
  domainOpacity: 0.4, tickColor: ink, tickOpacity: 0.4, titleFontWeight: "normal" };
const config = { background: null, font: "system-ui, sans-serif", axis, view: { stroke: null },
  legend: { labelColor: ink, titleColor: ink }, title: { color: ink },
  header: { labelColor: ink, titleColor: ink } };

/** The values under the pointer, as text. */
const pointer = document.createElement("div");
pointer.className = "pointer";
pointer.hidden = true;
document.body.append(pointer);
function tooltip(_handler, event, _item, value) {
  const text = value && typeof value === "object" ? Object.values(value)[0] : value;
  pointer.hidden = text === undefined || text === null || text === "";
  pointer.textContent = pointer.hidden ? "" : String(text);
  pointer.style.left = `${Math.min(event.clientX + 14, innerWidth - 400)}px`;
  pointer.style.top = `${event.clientY + 14}px`;
}

/** Panels beside each other stand below each other where the page is narrow, each with its rows' names. */
const NARROW = 760;
function fitted(spec, width) {
  if (!spec.hconcat || width >= NARROW) return spec;
  const { hconcat, ...rest } = spec;
  const vconcat = hconcat.map((panel) => {
    const square = panel.width === panel.height;
    const room = Math.max(120, width - (square ? 95 : 190));
    const fits = square ? { width: Math.min(panel.width, room), height: Math.min(panel.height, room) }
      : { width: Math.min(420, room) };
    for (const layer of panel.layer ?? [])
      if (!square && layer.encoding?.y?.axis) Object.assign(layer.encoding.y.axis, { labels: true, ticks: true });
    return { ...panel, ...fits };
  });
  return { ...rest, vconcat };
}

/** Draw one linked picture. */
async function draw(element) {
  const name = element.dataset.spec;
  const spec = fitted(structuredClone(specs[name]), element.clientWidth);
  const named = JSON.stringify(spec);
  spec.datasets = Object.fromEntries(Object.keys(data)
    .filter((key) => named.includes(`"name":${JSON.stringify(key)}`)).map((key) => [key, rows(key)]));
  views.get(name)?.finalize();
  const made = await window.vegaEmbed(element, spec,
    { actions: false, renderer: "svg", tooltip, config });
  views.set(name, made);
  made.view.addEventListener("click", (_event, item) => pick(made.view, item?.datum));
  await set(made.view, "chosen", chosen);
}

/** Set a signal of a view, where it has it. */
async function set(view, name, value) {
  const known = view.getState({ data: () => false, signals: () => true }).signals ?? {};
  if (name in known) await view.signal(name, value).runAsync();
}

/** What a click on a picture chooses: a trial, else a group; a click beside all lets a trial go. */
function pick(view, datum) {
  if (datum?.trial !== undefined || !datum?.group) set(view, "trial", datum?.trial ?? -1);
  else choose(datum.group);
}

/** Choose a group everywhere; choosing it again lets it go. */
function choose(group) {
  chosen = chosen === group ? "" : group;
  for (const button of document.querySelectorAll(".choose")) {
    const pressed = button.dataset.group === chosen;
    button.setAttribute("aria-pressed", String(pressed));
    button.closest("tr").classList.toggle("chosen", pressed);
  }
  for (const { view } of views.values()) set(view, "chosen", chosen);
  say(chosen ? `${chosen} is chosen` : "nothing is chosen");
}

/** The drawing that stands above a button, as SVG. */
function inPlace(button) {
  const source = button.closest("figure").querySelector("img").src.split(",")[1];
  return new TextDecoder().decode(Uint8Array.from(atob(source), (c) => c.charCodeAt(0)));
}

/** A drawing as an image of 300 dots per inch, on white as paper is; 96 pixels of a page are an inch. */
async function asPng(drawn) {
  const image = new Image();
  image.src = URL.createObjectURL(new Blob([drawn], { type: "image/svg+xml" }));
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [image.width, image.height].map((v) => Math.round((v * 300) / 96));
  const paper = canvas.getContext("2d");
  paper.fillStyle = "white";
  paper.fillRect(0, 0, canvas.width, canvas.height);
  paper.drawImage(image, 0, 0, canvas.width, canvas.height);
  URL.revokeObjectURL(image.src);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

document.addEventListener("click", async (event) => {
  const button = event.target.closest("button");
  if (!button) return;
  const { group, csv: table, svg, vega, png, copy } = button.dataset;
  if (group !== undefined) choose(group);
  if (table) save(`${table}.csv`, csv(table), "text/csv");
  if (svg || vega) {
    const drawn = svg ? inPlace(button) : await views.get(vega).view.toSVG();
    if (png === undefined) save(`${svg ?? vega}.svg`, drawn, "image/svg+xml");
    else save(`${svg ?? vega}.png`, await asPng(drawn), "image/png");
  }
  if (copy) {
    await navigator.clipboard?.writeText(document.getElementById(copy).textContent);
    say("the paragraph is copied");
  }
});

for (const element of document.querySelectorAll(".vega")) await draw(element);
const turned = matchMedia(`(max-width: ${NARROW}px)`);
turned.addEventListener("change", async () => {
  for (const element of document.querySelectorAll(".vega")) await draw(element);
});
document.body.dataset.ready = "yes";
