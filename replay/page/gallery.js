// List of a folder's replays, with filters by infraction, and sort orders.

const INFRACTIONS = [
  { name: "collisions", text: "Collisions", color: "--collision" },
  { name: "off_road", text: "Off road", color: "--off-road" },
  { name: "red_light", text: "Red lights", color: "--red-light" },
  { name: "wall_contacts", text: "Walls", color: "--wall-contact" },
];
const COLUMNS = [...INFRACTIONS, { name: "goals_reached", text: "Goals", color: "--goal" }, { name: "km_driven", text: "km", color: "--accent", digits: 1 }];
const ORDERS = [
  { name: "worst", text: "worst first", of: e => -e.infractions },
  { name: "per_km", text: "fewest km per infraction", of: e => -e.infractions / Math.max(1e-3, e.metrics.km_driven) },
  { name: "goals", text: "fewest goals", of: e => e.metrics.goals_reached },
  { name: "reward", text: "lowest reward", of: e => e.metrics.reward },
  { name: "file", text: "name of the file", of: () => 0 },
];

const entries = JSON.parse(byId("entries").textContent);
const most = Object.fromEntries(COLUMNS.map(({ name }) => [name, Math.max(1e-9, ...entries.map(entry => entry.metrics[name]))]));
const asked = new Set();
let order = ORDERS[0];

function card(entry) {
  const link = make("a"), title = make("span");
  const first = entry.first_infraction;
  // Shows the agent of the first infraction, a little before it.
  link.href = encodeURIComponent(entry.file) + (first ? `#step=${Math.max(0, first.frame - Math.round(3 / entry.dt_s))}&agent=${first.agent}&zoom=6` : "");
  title.append(make("strong", `${entry.map}, ${worldName(entry)}`), make("small", `${policyName(entry)}, ${entry.agents} agents, ${((entry.frames - 1) * entry.dt_s).toFixed(0)} s; ${entry.file}`));
  title.title = entry.policy;
  link.append(title);
  for (const { name, text, color, digits } of COLUMNS) {
    const value = entry.metrics[name], box = make("div", undefined, value ? "" : "none"), bar = make("i");
    bar.style.cssText = `width:${100 * value / most[name]}%;color:var(${color})`;
    box.append(make("b", value.toFixed(digits ?? 0)), text.toLowerCase(), bar);
    link.append(box);
  }
  const item = make("li");
  item.append(link);
  return item;
}

function show() {
  const shown = entries.filter(entry => [...asked].every(name => entry.metrics[name] > 0));
  const values = new Map(shown.map(entry => [entry, order.of(entry)]));
  shown.sort((a, b) => values.get(a) - values.get(b) || (a.file < b.file ? -1 : 1));
  byId("list").replaceChildren(...shown.map(card));
  byId("none").hidden = shown.length > 0;
  byId("summary").textContent = `${shown.length} of ${entries.length}`;
  const hash = new URLSearchParams();
  if (asked.size) hash.set("with", [...asked].join(","));
  if (order !== ORDERS[0]) hash.set("order", order.name);
  try { history.replaceState(null, "", `#${hash}`); } catch { /* a browser that allows no more changes now */ }
}

const hash = new URLSearchParams(location.hash.slice(1));
for (const name of (hash.get("with") || "").split(",")) if (INFRACTIONS.some(i => i.name === name)) asked.add(name);
order = ORDERS.find(o => o.name === hash.get("order")) || order;
for (const { name, text, color } of INFRACTIONS) {
  const button = make("button"), dot = make("span", undefined, "dot");
  dot.style.color = `var(${color})`;
  button.append(dot, text);
  button.setAttribute("aria-pressed", asked.has(name));
  button.addEventListener("click", () => {
    if (!asked.delete(name)) asked.add(name);
    button.setAttribute("aria-pressed", asked.has(name));
    show();
  });
  byId("filters").append(button);
}
for (const { name, text } of ORDERS) {
  const option = make("option", text);
  option.value = name;
  byId("order").append(option);
}
byId("order").value = order.name;
byId("order").addEventListener("change", event => { order = ORDERS.find(o => o.name === event.target.value); show(); });
show();
